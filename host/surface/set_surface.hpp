#pragma once
/// `extract_surface` for callers that know the stop radii.

#include "qjulia/surface.hpp"

namespace qjulia {

/// Map and options are valid.
TriangleMesh set_surface(const Device& device, const RationalMap& map, const StopRadii& stops,
                         const SurfaceOptions& options, const Watch& watch);

}  // namespace qjulia
