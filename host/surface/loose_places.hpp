#pragma once
/// Where the loose pieces of a set lie. These are flakes beside its bodies, and pictures leave them
/// out.

#include <cstdint>
#include <functional>
#include <vector>

#include "lattice/grid.hpp"
#include "qjulia/surface/figures.hpp"
#include "surface/fine_bodies.hpp"

namespace qjulia::surface {

/// Points of a regular grid. Each stands for the place that is nearer to it than to other points.
struct LoosePlaces {
  Grid grid;  ///< has no points if nothing is loose
  /// A bit for each point, x fastest, the lowest first: whether its place belongs to a loose piece.
  std::vector<std::uint32_t> bits;
  LoosePieces pieces;  ///< map units
  /// Step of the finer grid on which pieces were sought, map units: smaller pieces may have been
  /// missed.
  double resolution = 0;
  double largest_loose = 0;  ///< the least volume of a body, which is never loose, map units

  /// Some of the grid's cells have points of a finer grid: so many along each side, from the lower
  /// corner on.
  int finer = 0;
  /// Two words for each word of `bits`: which of its points are the lower corners of such cells,
  /// and how many such cells come before these.
  std::vector<std::uint32_t> finer_cells;
  std::vector<std::uint32_t> finer_bits;  ///< a bit for each finer point, cell by cell

  // What `look_finer` starts from.
  std::vector<bool> is_kept;                        ///< points inside that are not loose
  std::vector<std::vector<std::size_t>> of_pieces;  ///< numbers of each loose piece's inside points

  bool holds(const Eigen::Vector3d& p) const;
};

/// Finds the pieces that are less than a hundredth as large as the largest, as `drop_loose_pieces`
/// does in a mesh. Points of the grid that are inside hang together along its edges. In and around
/// a piece that looks loose, points of a finer grid are asked for until they show what the piece is
/// attached to, or that it is attached to nothing. Crumbs between the points of `grid` are found in
/// cells that have no corner in a body. They are loose unless they reach into a cell that has one.
/// @param is_inside at the points of `grid`, x fastest.
/// @param may_be_inside at the same points: whether anything between a point and its neighbours may
///   be inside.
/// @param divisions steps of the finer grid in a step of the grid.
LoosePlaces find_loose_places(const Grid& grid, const std::vector<bool>& is_inside,
                              const std::vector<bool>& may_be_inside, int divisions,
                              const Insides& insides);

/// Whether anything within `reach` (map units) of a point may be in sight.
using Sight = std::function<bool(const Eigen::Vector3d& point, double reach)>;

/// Looks more finely at and around the loose pieces that are in sight; the result replaces that of
/// the last such look. In it, points also hang together across diagonals. Bodies that are kept, and
/// pieces that turn out to be attached to them, then lose only what is thinner than a step of the
/// finer grid. Pieces are followed beyond what is in sight, so that what is found of them depends
/// only on `finer`.
/// @param finer steps of the finer grid in a step of the grid; there are fewer if it would take
/// more
///   than a few million points.
void look_finer(LoosePlaces& places, int finer, const Sight& is_in_sight, const Insides& insides);

}  // namespace qjulia::surface
