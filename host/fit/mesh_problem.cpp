#include "fit/mesh_problem.hpp"

#include "fit/finish_map.hpp"
#include "mesh/overlap.hpp"
#include "qjulia/map/field.hpp"

namespace qjulia::fitting {
namespace {

/// The centres of the cells of a coarse cube about the box.
std::vector<Eigen::Vector3d> coarse_grid(const Box& box) {
  const Box cube = shape::cube_to_count(box);
  const double cell = cube.size().x() / kOverlapCells;
  std::vector<Eigen::Vector3d> points;
  for (int x = 0; x < kOverlapCells; ++x) {
    for (int y = 0; y < kOverlapCells; ++y) {
      for (int z = 0; z < kOverlapCells; ++z) {
        points.emplace_back(cube.low + cell * Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5));
      }
    }
  }
  return points;
}

}  // namespace

MeshProblem::MeshProblem(const Device& device, MeasuredMesh mesh, SampleWeights weights,
                         Precision precision, std::stop_token stop)
    : device_(device),
      mesh_(std::move(mesh)),
      weights_(std::move(weights)),
      precision_(precision),
      stop_(std::move(stop)) {
  const auto points = coarse_grid(mesh_.shape.shape_to_map.to_map(mesh_.shape.box));
  cells_ = on_slice(points, 0);
  for (const double d : mesh_.distance.at(points, stop_)) inside_.push_back(d < 0);
}

Samples MeshProblem::draw(const Level& level, base::Random& random) const {
  Samples samples = level.points == Points::grid
                        ? grid_samples(mesh_.shape, mesh_.distance, level, stop_)
                        : mesh_.pool.draw(level, random);
  if (weights_) weigh(samples, weights_, mesh_.shape.shape_to_map, level.loss);
  return samples;
}

std::unique_ptr<Evaluator> MeshProblem::evaluator(const Samples& samples,
                                                  const EnergySettings& options) const {
  return make_device_evaluator(device_, samples, options, precision_);
}

std::vector<double> MeshProblem::distances(const std::vector<Eigen::Vector3d>& points) const {
  return mesh_.distance.at(points);
}

double MeshProblem::overlap(const Map& map, int iterations) const {
  const auto field = Field(device_, map).at(cells_, iterations);
  shape::Overlap overlap;
  for (std::size_t i = 0; i < field.size(); ++i) {
    overlap.add(field[i] < map.dynamics.surface_level, inside_[i]);
  }
  return overlap.iou();
}

FinishedMap MeshProblem::finished(const Map& map) const {
  FinishedMap result;
  result.map = finish_map(device_, map, mesh_.shape, mesh_.pool, mesh_.detail, result.warnings);
  result.map.layers.steepness = mesh_.steepness;
  result.map.frame.up = mesh_.up;
  return result;
}

std::string MeshProblem::poor_fit(const Map& map, double iou) const {
  return fitting::poor_fit(device_, map, iou, mesh_.pool);
}

double MeshProblem::mean_distance(const Map& map) const {
  return fitting::mean_distance(device_, map, mesh_.pool);
}

}  // namespace qjulia::fitting
