#pragma once
/// Factors in blocks of neighbours.

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "qjulia/map/map.hpp"

namespace qjulia::energy {

/// The numbers of the factors in each block, ascending; every factor is in one block.
using NeighbourBlocks = std::vector<std::vector<std::size_t>>;

/// Most factors in a block of a fit (docs/lab/fitting.md says what other sizes cost and gain).
constexpr std::size_t kFactorsOfBlock = 128;

/// Divides a map's factors by their centres' X, Y and Z into as few blocks as there can be of at
/// most `most` factors. The blocks have equally many, to within one. Each cut is across the longest
/// side of the box around the centres that it divides.
NeighbourBlocks neighbour_blocks(const Map& map, std::size_t most);

/// The numbers of a block's variables among all of a map (S, exponents, centres' X, Y, Z and W):
/// its m exponents, then m of each coordinate.
/// @param factors of the map.
std::vector<Eigen::Index> variables_of(const std::vector<std::size_t>& block, std::size_t factors);

}  // namespace qjulia::energy
