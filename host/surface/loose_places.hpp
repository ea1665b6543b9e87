#pragma once
/// Where loose pieces of a set lie: flakes beside its bodies that are left out of pictures.

#include <cstdint>
#include <functional>
#include <vector>

#include "qjulia/figures.hpp"
#include "surface/fine_bodies.hpp"
#include "surface/grid.hpp"

namespace qjulia::surface {

/// Points of a regular grid, each with what lies nearer to it than to others.
struct LoosePlaces {
  Grid grid;  ///< no points where nothing is loose
  /// A bit a point, x fastest, the lowest first: whether what lies there is of a loose piece.
  std::vector<std::uint32_t> bits;
  LoosePieces pieces;  ///< map units

  /// Some of the grid's cells have points of a finer grid, so many a side from the lower corner on.
  int finer = 0;
  /// Two words for each of `bits`: which of its points are the lower corners of such cells, and how
  /// many such cells there are before them.
  std::vector<std::uint32_t> finer_cells;
  std::vector<std::uint32_t> finer_bits;  ///< cell by cell

  // What `look_finer` goes on from.
  std::vector<bool> is_kept;                        ///< points inside that are not loose
  std::vector<std::vector<std::size_t>> of_pieces;  ///< numbers of each loose piece's inside points

  bool holds(const Eigen::Vector3d& p) const;
};

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

/// Whether something may be in sight at most `reach` from a point.
using Sight = std::function<bool(const Eigen::Vector3d& point, double reach)>;

/// Looks more finely at the loose pieces that are in sight, and at what is about them, in place of
/// the last finer look. What bodies that are kept, and pieces that are now seen to hang on them,
/// still lose is thinner than a step of the finer grid. Points hang together across diagonals, too.
/// Pieces are followed beyond what is in sight, so that what is found of them depends on `finer`
/// alone.
/// @param finer steps in a step of the grid; fewer where that were more than a few million points.
void look_finer(LoosePlaces& places, int finer, const Sight& is_in_sight, const Insides& insides);

}  // namespace qjulia::surface
