#include "surface/overlap.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "qjulia/error.hpp"

namespace qjulia {
namespace {

constexpr double kCubeSide = 1.15;  // in longest sides of the mesh's box
constexpr double kSharpness = 10;   // α

/// Sums over the cells on one side of the mesh.
struct Side {
  double weight = 0;
  double agreement = 0;  ///< Σ w s tanh(α (F_n − L))

  double mean() const { return weight > 0 ? agreement / weight : 0; }
};

}  // namespace

CubeSamples sample_cube(const SignedDistance& distance, const Box& about,
                        const ShapeToMap& shape_to_map, int resolution,
                        const std::optional<Box>& part, const Watch& watch) {
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.5 * kCubeSide * about.size().maxCoeff());
  const Box box = part.value_or(Box{about.center() - half, about.center() + half});
  CubeSamples samples;
  samples.cell = box.size().maxCoeff() / resolution;
  std::array<int, 3>& points = samples.grid.points;
  Eigen::Vector3d first;
  for (int axis = 0; axis < 3; ++axis) {
    const int cells = std::max(1, static_cast<int>(std::lround(box.size()[axis] / samples.cell)));
    points[static_cast<std::size_t>(axis)] = cells;
    first[axis] = box.center()[axis] - 0.5 * samples.cell * (cells - 1);
  }
  samples.grid.origin = shape_to_map.to_map(first);
  samples.grid.step = shape_to_map.scale * samples.cell;

  std::vector<Eigen::Vector3d> slice;
  for (int z = 0; z < points[2]; ++z) {
    if (watch.stop.stop_requested()) throw Interrupted();
    slice.clear();
    for (int y = 0; y < points[1]; ++y) {
      for (int x = 0; x < points[0]; ++x) {
        slice.push_back(first + samples.cell * Eigen::Vector3d(x, y, z));
      }
    }
    const auto values = distance.at(slice);
    samples.distance.insert(samples.distance.end(), values.begin(), values.end());
  }
  return samples;
}

Overlap overlap(const LevelSet& set, double level, const CubeSamples& samples, const Watch& watch) {
  std::size_t both = 0;
  std::size_t either = 0;
  std::array<Side, 2> sides;  // outside, inside
  std::size_t index = 0;
  const int at_once = slices_at_once(samples.grid);
  for (int z = 0; z < samples.grid.points[2]; z += at_once) {
    if (watch.stop.stop_requested()) throw Interrupted();
    const int count = std::min(at_once, samples.grid.points[2] - z);
    for (const float value : set.over(samples.grid, slices(samples.grid, z, count))) {
      const double distance = samples.distance[index++];
      const double field = static_cast<double>(value) - level;
      const bool in_mesh = distance < 0;
      both += in_mesh && field < 0 ? 1 : 0;
      either += in_mesh || field < 0 ? 1 : 0;
      const double weight = 1 / std::max(std::abs(distance), 0.5 * samples.cell);
      Side& side = sides[in_mesh ? 1 : 0];
      side.weight += weight;
      side.agreement += (in_mesh ? -weight : weight) * std::tanh(kSharpness * field);
    }
  }
  return {either > 0 ? static_cast<double>(both) / static_cast<double>(either) : 0,
          -0.5 * (sides[0].mean() + sides[1].mean())};
}

}  // namespace qjulia
