#pragma once
/// The part of a grid that empty balls reach.

#include <cstddef>
#include <vector>

#include "lattice/grid.hpp"

namespace qjulia::surface {

/// Whether each point of the grid, x fastest, lies in one of the balls about the points whose
/// `radius` is positive.
std::vector<bool> covered_by_balls(const Grid& grid, const std::vector<double>& radius);

}  // namespace qjulia::surface
