#pragma once
/// Normalising a mesh, and keeping the distance that was computed on the way.

#include "qjulia/mesh/shape.hpp"

namespace qjulia::shape {

struct ShapeWithDistance {
  Shape shape;
  SignedDistance distance;  ///< to the outer surface, in the given mesh's units
};

/// What `qjulia::make_shape` does.
ShapeWithDistance make_shape_with_distance(const Device& device, const TriangleMesh& mesh,
                                           const std::stop_token& stop = {});

}  // namespace qjulia::shape
