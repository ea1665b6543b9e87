#pragma once
/// A mesh of fewer triangles in place of a large one, in a fraction of a second.

#include <cstddef>
#include <stop_token>

#include "qjulia/mesh.hpp"

namespace qjulia::shape {

struct CoarseMesh {
  TriangleMesh mesh;
  double cell = 0;  ///< what is smaller is lost; the mesh's units
};

/// Puts the mean of all vertices in a cubic cell in place of each of them (Rossignac and Borrel
/// 1993). A triangle between three cells cancels its mirror image, so that a closed mesh stays
/// closed; where more than one is left, they lie upon each other. Cells are as small as leaves
/// `most` triangles or fewer, to a factor of two.
/// @throws Interrupted; InputError when the mesh has no area.
CoarseMesh coarse_mesh(const TriangleMesh& mesh, std::size_t most,
                       const std::stop_token& stop = {});

}  // namespace qjulia::shape
