#pragma once
/// Walls made thicker where they are thinner than a ball, on slices of a grid.

#include <optional>
#include <stop_token>

#include "print/slab_distances.hpp"

namespace qjulia::surface {

/// In steps.
struct ThickWalls {
  float radius = 0;     ///< half the least thickness
  float tolerance = 0;  ///< parts that stand out from the fitting balls by less are removed
};

/// Number of slices on either side that the result at a slice depends on.
int halo_of(const ThickWalls& walls);

/// Steps that a grid has to reach beyond the solid on all sides.
double margin_of(const ThickWalls& walls);

/// The distance from the union of two kinds of balls: those of at least that radius that fit into
/// the solid, and those of exactly that radius along the middles of parts that stand out from the
/// first by more than the tolerance; and from fillets between the latter. It is negative inside,
/// and exact near its zeros.
/// @param near the solid's, as `MeshInGrid::distances`.
/// @param floor where the solid is cut flat, in steps above the first slice: the second kind of
/// balls stand on it, for it would cut them thinner.
SlabField thickened(const SlabField& near, const ThickWalls& walls, std::optional<float> floor,
                    const std::stop_token& stop);

}  // namespace qjulia::surface
