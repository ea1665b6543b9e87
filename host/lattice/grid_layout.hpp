#pragma once
/// A grid as kernels take it.

#include <vector>

#include "lattice/grid.hpp"
#include "qjulia/base/box.hpp"

namespace qjulia::surface {

/// The reals that layout/picture_layout.h describes. @param seen the part of space that rays go
/// through.
std::vector<double> grid_layout(const Grid& grid, const Box& seen = {});

}  // namespace qjulia::surface
