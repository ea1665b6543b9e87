#pragma once
/// The box in which a set is meshed.

#include <functional>
#include <vector>

#include "lattice/grid.hpp"
#include "qjulia/base/progress.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia::surface {

/// The grid with `resolution` cells along the box's longest side, centred on the box and covering
/// it. Map units.
Grid grid_over(const Box& box, int resolution);

/// A field's values at a block of a grid's points, x fastest, then y.
using GridField = std::function<std::vector<float>(const Grid&, const GridBlock&)>;

/// Moves those sides of `box` outward that the set {field < level} touches on the grid of
/// `resolution` cells, until it touches none. Map units.
/// @param limit half the side of the cube about the origin that the box may grow to.
/// @throws Error when the set touches the sides of that cube.
Box enlarged_until_clear(const GridField& field, double level, Box box, int resolution,
                         double limit, const ProgressMonitor& monitor);

/// The box of the inside points of a coarse grid over `box`, with two cells of margin; `box` itself
/// when no point is inside.
Box shrunk_to_inside(const GridField& field, double level, const Box& box);

}  // namespace qjulia::surface
