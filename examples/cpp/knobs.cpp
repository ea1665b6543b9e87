// What detail and drift do to a set's roughness, as a table for plots:
// knobs MESH [STEPS [RESOLUTION]] >knobs.csv
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <qjulia/qjulia.hpp>

int main(int argc, char** argv) try {
  if (argc < 2) throw qjulia::InputError("usage: knobs MESH [STEPS [RESOLUTION]]");
  const int steps = argc > 2 ? std::atoi(argv[2]) : 8;
  const auto device = qjulia::Device::choose();
  const auto mesh = qjulia::read_mesh(argv[1]);
  // Exact and at once; a fitted map has the same knobs.
  const auto map = qjulia::exact_map(device, mesh, {});

  qjulia::CompareOptions options;
  options.resolution = argc > 3 ? std::atoi(argv[3]) : 96;
  std::cout << "drift,detail,roughness\n";  // the set's area over the mesh's
  for (const double drift : {0.0, 0.3, 0.6}) {
    for (int step = 0; step < steps; ++step) {
      qjulia::MapKnobs knobs;
      knobs.detail = 0.001 * std::pow(30, double(step) / std::max(1, steps - 1));
      knobs.drift = drift;
      const auto turned = qjulia::with_knobs(device, map, knobs);
      const auto metrics = qjulia::compare(device, turned, mesh, options).back();  // n = 6
      std::cout << drift << ',' << *knobs.detail << ',' << metrics.roughness << std::endl;
    }
  }
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
