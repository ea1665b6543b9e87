#pragma once
/// The set as a triangle mesh.

#include <optional>

#include "qjulia/field.hpp"
#include "qjulia/mesh.hpp"
#include "qjulia/progress.hpp"

namespace qjulia {

struct SurfaceOptions {
  int resolution = 256;    ///< cells along the box's longest side, 2 … 8192
  int iterations = 6;      ///< n; 1 is the fitted potential itself
  std::optional<Box> box;  ///< shape units; by default the shape's box plus 5 %, grown until
                           ///< nothing touches its faces
  void validate() const;   ///< @throws InputError
};

/// Marching cubes of F_n = L, evaluated on the device in slabs; shape units. Shared vertices;
/// closed and 2-manifold where the set stays clear of the box, oriented outward. Without
/// triangles when the box holds no surface.
/// @throws InputError naming the option or what is wrong with the map; Error when no box is clear
///   of the set; Interrupted when a stop is requested.
TriangleMesh extract_surface(const Device& device, const RationalMap& map,
                             const SurfaceOptions& options, const Watch& watch = {});

}  // namespace qjulia
