#pragma once
/// Limbs of a solid, and which of them another has as well.

#include <cstddef>
#include <vector>

#include "lattice/grid.hpp"

namespace qjulia::surface {

/// A part that stands off: its tip is farther from the origin, through the solid, than all that can
/// be reached from it on the way.
struct Limb {
  double length = 0;             ///< from the tip back to where it meets what reaches farther
  std::vector<std::size_t> tip;  ///< points in the last quarter of the length
};

/// Limbs that are at least `least` long. Distances are shortest ways from point to point of the
/// grid, diagonals too, from the inside point nearest to the origin. A solid that reaches hardly
/// farther than its nearest outside point has none.
/// @param is_inside x fastest. @param least map units.
std::vector<Limb> find_limbs(const Grid& grid, const std::vector<bool>& is_inside, double least);

/// How many of these limbs reach into the last quarter of their length in another solid, without
/// being cut off from the origin.
int limbs_kept(const std::vector<Limb>& limbs, const Grid& grid,
               const std::vector<bool>& is_inside);

}  // namespace qjulia::surface
