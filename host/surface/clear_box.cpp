#include "surface/clear_box.hpp"

#include <algorithm>
#include <cmath>

#include "qjulia/error.hpp"

namespace qjulia::surface {
namespace {

/// How far a touched side moves at a time, as a fraction of the longest side.
constexpr double kGrowth = 0.1;
/// Cells along each side of the grid on which the set's extent is found.
constexpr int kCoarse = 64;

/// The block of points in the grid's side 2 · axis + side.
GridBlock side_of(const Grid& grid, int axis, int side) {
  GridBlock block = whole(grid);
  const auto a = static_cast<std::size_t>(axis);
  block.first[a] = side == 0 ? 0 : grid.points[a] - 1;
  block.count[a] = 1;
  return block;
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

Box enlarged_until_clear(const GridField& field, double level, Box box, int resolution,
                         double limit, const ProgressMonitor& monitor) {
  const auto inside_below = static_cast<float>(level);
  const auto is_inside = [inside_below](float f) { return f < inside_below; };
  for (;;) {
    const Grid grid = grid_over(box, resolution);
    const double growth = kGrowth * box.size().maxCoeff();
    bool touched = false;
    for (int axis = 0; axis < 3; ++axis) {
      for (int side = 0; side < 2; ++side) {
        throw_if_stopped(monitor.stop);
        if (std::ranges::none_of(field(grid, side_of(grid, axis, side)), is_inside)) continue;
        touched = true;
        double& bound = side == 0 ? box.low[axis] : box.high[axis];
        if (std::abs(bound) > limit) {
          throw Error("the set reaches beyond every box that was tried; give a box");
        }
        bound += side == 0 ? -growth : growth;
      }
    }
    if (!touched) return box;
  }
}

Box shrunk_to_inside(const GridField& field, double level, const Box& box) {
  const Grid grid = grid_over(box, kCoarse);
  const auto inside_below = static_cast<float>(level);
  const auto values = field(grid, whole(grid));
  const auto inside = marked_indices(grid, [&](std::size_t i) { return values[i] < inside_below; });
  if (!inside) return box;
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(2);
  return {grid.at(inside->first.cast<double>() - margin),
          grid.at(inside->second.cast<double>() + margin)};
}

}  // namespace qjulia::surface
