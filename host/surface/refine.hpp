#pragma once

#include <vector>

#include "surface/marching_cubes.hpp"

namespace qjulia {

/// Halves each vertex's edge `halvings` times, keeping the half whose ends lie on different sides
/// of the level, and puts the vertex in the middle of what is left. Interpolation of F_n, which
/// jumps where orbits part, leaves ripples; sides do not.
void refine(const LevelSet& set, double level, const Grid& grid, int halvings,
            std::vector<EdgeVertex>& vertices);

}  // namespace qjulia
