#pragma once
/// Where to compute what is interpolated at points of a block.

#include <cstdint>
#include <span>
#include <vector>

#include "lattice/grid.hpp"

namespace qjulia::surface {

/// Nodes at every `spacing`-th point of a block along x and y, in each of its slices; they go on
/// beyond the block's sides. Interpolation takes three of them before a point and three after,
/// first along y, to where columns of nodes meet the block's rows, then along x.
struct NodeLattice {
  int spacing = 1;
  GridBlock nodes;  ///< grid point of the first node; nodes along x and y, slices
  int rows = 0;     ///< of the block in a slice

  /// Numbers of nodes that are needed, x fastest, then y, rising.
  std::vector<std::int32_t> needed_nodes;
  /// Numbers of the meetings of columns and rows that are needed, column fastest, rising.
  std::vector<std::int32_t> needed_meetings;

  /// Meetings of columns and rows, in all.
  std::size_t meetings() const;
};

/// @param asking numbers of points in `block` (x fastest, then y), rising.
NodeLattice node_lattice(const GridBlock& block, int spacing, std::span<const std::int32_t> asking);

}  // namespace qjulia::surface
