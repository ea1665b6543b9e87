#pragma once

#include "qjulia/surface.hpp"

namespace qjulia::surface {

/// `extract_surface` for callers that know the stop radii. Map and options are valid.
SurfaceReport level_set_surface(const Device& device, const RationalMap& map,
                                const StopRadii& stops, const SurfaceOptions& options,
                                SurfaceSink& sink, const ProgressMonitor& monitor);

}  // namespace qjulia::surface
