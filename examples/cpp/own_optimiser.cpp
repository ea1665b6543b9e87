// Samples and an optimiser of your own in place of the library's:
// own_optimiser MESH [FACTORS [SAMPLES [ITERATIONS]]]
#include <LBFGS.h>

#include <cstdlib>
#include <iostream>
#include <qjulia/qjulia.hpp>
#include <random>

int main(int argc, char** argv) try {
  if (argc < 2)
    throw qjulia::InputError("usage: own_optimiser MESH [FACTORS [SAMPLES [ITERATIONS]]]");
  const std::size_t count = argc > 3 ? std::strtoul(argv[3], nullptr, 10) : 20000;
  const auto device = qjulia::Device::choose();
  const auto mesh = qjulia::read_mesh(argv[1]);
  const auto box = mesh.box();

  // The library places the factors, and hardly moves them in one evaluation.
  qjulia::FitOptions placing;
  placing.factors = argc > 2 ? std::atoi(argv[2]) : 64;
  placing.max_evaluations = 1;
  const auto placed = qjulia::fit(device, mesh, placing).map;

  // Points about the surface, each on a side of it.
  std::mt19937_64 random(1);
  std::normal_distribution<double> offset(0, 0.1 * (box.high - box.low).maxCoeff());
  std::vector<Eigen::Vector3d> places;
  for (const auto& point : qjulia::sample_surface(mesh, count, 1)) {
    places.emplace_back(point.position + offset(random) * point.normal);
  }
  qjulia::EnergySamples samples;
  for (const double distance : qjulia::SignedDistance(device, mesh).at(places)) {
    samples.sides.push_back(distance < 0 ? -1 : 1);
  }
  for (auto& place : places) place = placed.frame.shape_to_map.to_map(place);
  samples.points = qjulia::on_slice(places, placed.dynamics.slice);

  qjulia::EnergyOptions options;
  options.loss = qjulia::EnergyLoss::tanh;
  options.alpha = 10;
  if (device.info().has_double) options.precision = qjulia::Precision::dbl;
  const qjulia::Energy energy(device, placed, samples, options);

  const auto start = energy.unknowns();
  Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(start.data(), Eigen::Index(start.size()));
  int evaluations = 0;
  const auto function = [&](const Eigen::VectorXd& at, Eigen::VectorXd& gradient) {
    ++evaluations;
    return energy.value_and_gradient({at.data(), start.size()}, {gradient.data(), start.size()});
  };
  LBFGSpp::LBFGSParam<double> parameters;
  parameters.max_iterations = argc > 4 ? std::atoi(argv[4]) : 200;
  LBFGSpp::LBFGSSolver<double> solver(parameters);
  double found = 0;
  solver.minimize(function, x, found);
  std::cout << "energy " << energy.value(start) << " -> " << found << " in " << evaluations
            << " evaluations\n";

  const auto best = qjulia::calibrated(device, energy.map_at({x.data(), start.size()}));
  qjulia::write_map(best, "own.qjulia.json");
  std::cout << "IoU " << qjulia::compare(device, best, mesh, {.resolution = 64}).front().iou
            << '\n';
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
