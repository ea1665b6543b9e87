#pragma once
/// A grid of points as kernels take it.

#include <vector>

#include "layout/picture_layout.h"
#include "qjulia/mesh.hpp"
#include "surface/grid.hpp"

namespace qjulia::picture {

/// layout/picture_layout.h. @param seen the part of space that rays go through.
inline std::vector<double> grid_layout(const surface::Grid& grid, const Box& seen = {}) {
  std::vector<double> reals(QJ_GRID_SIZE);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    reals[QJ_GRID_ORIGIN + i] = grid.origin[axis];
    reals[QJ_GRID_POINTS + i] = grid.points[i];
    reals[QJ_GRID_SEEN_LOW + i] = seen.low[axis];
    reals[QJ_GRID_SEEN_HIGH + i] = seen.high[axis];
  }
  reals[QJ_GRID_STEP] = grid.step;
  return reals;
}

}  // namespace qjulia::picture
