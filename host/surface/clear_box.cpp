#include "surface/clear_box.hpp"

#include <algorithm>
#include <cmath>

#include "qjulia/error.hpp"

namespace qjulia {
namespace {

/// How far a touched side moves at a time, as a fraction of the longest side.
constexpr double kGrowth = 0.1;
/// Cells along each side of the grid that a set is looked for on.
constexpr int kCoarse = 64;

/// The block of points in the grid's side 2 · axis + side.
GridBlock side_of(const Grid& grid, int axis, int side) {
  GridBlock block{{0, 0, 0}, grid.points};
  const auto a = static_cast<std::size_t>(axis);
  block.first[a] = side == 0 ? 0 : grid.points[a] - 1;
  block.count[a] = 1;
  return block;
}

bool any_inside(const LevelSet& set, float level, const Grid& grid, const GridBlock& block) {
  return std::ranges::any_of(set.over(grid, block), [level](float f) { return f < level; });
}

}  // namespace

Grid grid_over(const Box& box, int resolution) {
  Grid grid;
  grid.step = box.size().maxCoeff() / resolution;
  Eigen::Vector3d cells;
  for (int axis = 0; axis < 3; ++axis) {
    // A side that is a whole number of steps but for rounding is not given one more.
    cells[axis] = std::max(1.0, std::ceil(box.size()[axis] / grid.step - 1e-6));
    grid.points[static_cast<std::size_t>(axis)] = static_cast<int>(cells[axis]) + 1;
  }
  grid.origin = box.center() - 0.5 * grid.step * cells;
  return grid;
}

Box grown_clear(const LevelSet& set, double level, Box box, int resolution, double limit,
                const Watch& watch) {
  for (;;) {
    const Grid grid = grid_over(box, resolution);
    const double growth = kGrowth * box.size().maxCoeff();
    bool touched = false;
    for (int axis = 0; axis < 3; ++axis) {
      for (int side = 0; side < 2; ++side) {
        if (watch.stop.stop_requested()) throw Interrupted();
        if (!any_inside(set, static_cast<float>(level), grid, side_of(grid, axis, side))) continue;
        touched = true;
        double& bound = side == 0 ? box.low[axis] : box.high[axis];
        if (std::abs(bound) > limit) {
          throw Error("the set reaches out of every box it was looked for in; give --box");
        }
        bound += side == 0 ? -growth : growth;
      }
    }
    if (!touched) return box;
  }
}

Box tightened(const LevelSet& set, double level, const Box& box) {
  const Grid grid = grid_over(box, kCoarse);
  const auto inside_below = static_cast<float>(level);
  Eigen::Vector3i low(grid.points[0], grid.points[1], grid.points[2]);
  Eigen::Vector3i high(-1, -1, -1);
  const auto values = set.over(grid, {{0, 0, 0}, grid.points});
  std::size_t index = 0;
  for (int k = 0; k < grid.points[2]; ++k) {
    for (int j = 0; j < grid.points[1]; ++j) {
      for (int i = 0; i < grid.points[0]; ++i, ++index) {
        if (!(values[index] < inside_below)) continue;
        low = low.cwiseMin(Eigen::Vector3i(i, j, k));
        high = high.cwiseMax(Eigen::Vector3i(i, j, k));
      }
    }
  }
  if (high.x() < 0) return box;
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(2);
  return {grid.at(low.cast<double>() - margin), grid.at(high.cast<double>() + margin)};
}

}  // namespace qjulia
