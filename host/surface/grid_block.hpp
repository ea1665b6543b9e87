#pragma once
#include "device/context.hpp"
#include "layout/grid_block.h"
#include "surface/grid.hpp"

namespace qjulia::surface {

/// A block of the grid's points as kernels take it.
inline device::Argument grid_block(const Grid& grid, const GridBlock& block, Precision precision) {
  return device::arguments(precision, [&](auto r) {
    using real = decltype(r);
    return qj_grid_block<real>{.origin_x = real(grid.origin.x()),
                               .origin_y = real(grid.origin.y()),
                               .origin_z = real(grid.origin.z()),
                               .step = real(grid.step),
                               .nx = block.count[0],
                               .ny = block.count[1],
                               .ix = block.first[0],
                               .iy = block.first[1],
                               .iz = block.first[2]};
  });
}

}  // namespace qjulia::surface
