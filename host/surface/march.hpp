#pragma once
/// A level set's surface on one grid.

#include "surface/assembly.hpp"

namespace qjulia {

/// Marching cubes of {F_n = level} over the grid, slab by slab.
/// @param set, second the same set on a device and on its sibling: two layers are evaluated at a
///   time, so that the device has work while the host looks at what came back.
/// @param reach as `MarchingCubes` takes it.
/// @param options dense and refine.
/// @return vertices, triangles and open edges.
SurfaceReport march(const LevelSet& set, const LevelSet& second, double level, double reach,
                    const Grid& grid, const SurfaceOptions& options, Assembly& assembly,
                    const Watch& watch);

}  // namespace qjulia
