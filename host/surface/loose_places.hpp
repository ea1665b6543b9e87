#pragma once
/// Where loose pieces of a set lie: flakes beside its bodies that are left out of pictures.

#include <cstdint>
#include <functional>
#include <vector>

#include "qjulia/figures.hpp"
#include "surface/grid.hpp"

namespace qjulia::surface {

/// Points of a regular grid, each with what lies nearer to it than to others.
struct LoosePlaces {
  Grid grid;  ///< no points where nothing is loose
  /// A bit a point, x fastest, the lowest first: whether what lies there is of a loose piece.
  std::vector<std::uint32_t> bits;
  LoosePieces pieces;  ///< map units

  bool holds(const Eigen::Vector3d& p) const;
};

/// Whether each of these points of the set's space, map coordinates, is inside.
using Insides = std::function<std::vector<bool>(const std::vector<Eigen::Vector3d>&)>;

/// Finds the pieces that are less than a hundredth as large as the largest, as
/// `drop_loose_pieces` does of a mesh. Points of the grid that are inside hang together along its
/// edges. Of a piece that looks loose, and of what is about it, points of a finer grid are asked
/// for until they show what it hangs on, or that it hangs on nothing. Crumbs between the points of
/// `grid` are found where no corner of a cell is in a body, and loose unless they reach into a cell
/// where one is.
/// @param is_inside at the points of `grid`, x fastest.
/// @param may_be_inside whether anything between a point and its neighbours may be.
/// @param divisions of the grid's step, for the finer grid.
LoosePlaces find_loose_places(const Grid& grid, const std::vector<bool>& is_inside,
                              const std::vector<bool>& may_be_inside, int divisions,
                              const Insides& insides);

}  // namespace qjulia::surface
