#pragma once
/// How a set and a mesh share a cube of cells.

#include <optional>
#include <vector>

#include "qjulia/mesh.hpp"
#include "qjulia/progress.hpp"
#include "qjulia/shape.hpp"
#include "surface/level_set.hpp"

namespace qjulia {

/// Cell centres of a cube about a mesh, and the mesh's signed distance there.
struct CubeSamples {
  Grid grid;                     ///< the centres, map units
  std::vector<double> distance;  ///< of the mesh, negative inside, its own units; x fastest
  double cell = 0;               ///< side of a cell, the mesh's units
};

/// `resolution` cells along the longest side of `part`, or where there is none, `resolution`³ of a
/// cube centred on the box `about`, side 1.15 × its longest side.
/// @param distance of the mesh.
/// @param part the mesh's units.
CubeSamples sample_cube(const SignedDistance& distance, const Box& about,
                        const ShapeToMap& shape_to_map, int resolution,
                        const std::optional<Box>& part, const Watch& watch);

struct Overlap {
  double iou = 0;  ///< cells inside both over cells inside either
  double energy = 0;  ///< −Σ w s tanh(α (F_n − L)), α = 10, w ∝ 1 / max(distance, half a cell),
                      ///< inside and outside weights of sum ½ each (Kim 2015, Eq. 10, normalised)
};

/// The set F_n < `level` against the mesh.
Overlap overlap(const LevelSet& set, double level, const CubeSamples& samples, const Watch& watch);

}  // namespace qjulia
