#pragma once
/// One map's shape with another's grooves.

#include "qjulia/base/progress.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia {

constexpr int kTransferCells = 192;

/// `map` with the versor and the phase of `grooves`, which is made as much larger as the inradius
/// is: both origins, the deepest points, stay in place. A noise goes to any map. Factors go to
/// exact maps alone, since a map has one list of them; a fitted map therefore becomes an exact one,
/// which holds the fitted shape's distances on a grid.
/// @param cells of that grid along its longest side, as `ExactMapOptions::resolution`.
/// @throws InputError where a map is quadratic, or does not say its inradius, or a fitted one its
/// box
///   and detail; OptionError naming `cells`; Interrupted.
Map with_versor_of(const Device& device, const Map& map, const Map& grooves,
                   int cells = kTransferCells, const ProgressMonitor& monitor = {});

}  // namespace qjulia
