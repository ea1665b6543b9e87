#include "lattice/clear_box.hpp"

#include <algorithm>
#include <cmath>

#include "qjulia/base/error.hpp"

namespace qjulia::surface {
namespace {

/// How far a touched side moves at a time, as a fraction of the longest side.
constexpr double kGrowth = 0.1;
/// Cells along each side of the grid on which the set's extent is found.
constexpr int kCoarse = 64;

/// The block of points in the grid's side 2 · axis + side.
GridBlock side_of(const Grid& grid, int axis, int side) {
  GridBlock block = whole(grid);
  block.first[axis] = side == 0 ? 0 : grid.points[axis] - 1;
  block.count[axis] = 1;
  return block;
}

}  // namespace

Grid grid_over(const Box& box, int resolution) {
  const double step = box.size().maxCoeff() / resolution;
  // A side that is a whole number of steps but for rounding is not given one more.
  const Eigen::Array3d cells = (box.size().array() / step - 1e-6).ceil().max(1.0);
  return {box.center() - 0.5 * step * cells.matrix(), step, cells.cast<int>() + 1};
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
  return {grid.point(inside->first.array() - 2), grid.point(inside->second.array() + 2)};
}

}  // namespace qjulia::surface
