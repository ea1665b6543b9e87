#pragma once
/// A level set's surface on one grid.

#include "surface/assembly.hpp"

namespace qjulia {

/// Marching cubes of {F_n = level} over the grid, slab by slab.
/// @param reach as `MarchingCubes` takes it.
/// @param options dense and refine.
/// @return vertices, triangles and open edges.
SurfaceReport march(const LevelSet& set, double level, double reach, const Grid& grid,
                    const SurfaceOptions& options, Assembly& assembly, const Watch& watch);

}  // namespace qjulia
