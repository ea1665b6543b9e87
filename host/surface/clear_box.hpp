#pragma once
/// The box a set is meshed in.

#include "qjulia/progress.hpp"
#include "surface/level_set.hpp"

namespace qjulia {

/// The grid with `resolution` cells along the box's longest side, centred on the box and covering
/// it. Map units.
Grid grid_over(const Box& box, int resolution);

/// `box` with the sides moved outward that the set {F_n < level} touches on the grid of
/// `resolution` cells, until it touches none. Map units.
/// @param limit half the side of the cube about the origin that the box may grow to.
/// @throws Error when the set touches the sides of that cube.
Box grown_clear(const LevelSet& set, double level, Box box, int resolution, double limit,
                const Watch& watch);

/// The box of the inside points of a coarse grid over `box`, with two cells of margin; `box` itself
/// when no point is inside.
Box tightened(const LevelSet& set, double level, const Box& box);

}  // namespace qjulia
