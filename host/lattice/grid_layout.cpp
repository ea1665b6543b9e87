#include "lattice/grid_layout.hpp"

#include "layout/picture_layout.h"

namespace qjulia::surface {

std::vector<double> grid_layout(const Grid& grid, const Box& seen) {
  std::vector<double> reals(QJ_GRID_SIZE);
  Eigen::Map<Eigen::VectorXd> layout(reals.data(), QJ_GRID_SIZE);
  layout.segment<3>(QJ_GRID_ORIGIN) = grid.origin;
  layout.segment<3>(QJ_GRID_POINTS) = grid.points.cast<double>();
  layout.segment<3>(QJ_GRID_SEEN_LOW) = seen.low;
  layout.segment<3>(QJ_GRID_SEEN_HIGH) = seen.high;
  reals[QJ_GRID_STEP] = grid.step;
  return reals;
}

}  // namespace qjulia::surface
