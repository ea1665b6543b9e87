#pragma once
/// How far points of a grid are from balls.

#include <cstddef>
#include <vector>

#include "lattice/grid.hpp"

namespace qjulia::surface {

/// For each point p of the grid, x fastest, the least |p − q|² − r² over the balls about those
/// points q whose radius r is positive: 0 or less within a ball, infinity if there is no ball.
std::vector<double> power_of_balls(const Grid& grid, const std::vector<double>& radius);

}  // namespace qjulia::surface
