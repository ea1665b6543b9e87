#pragma once
/// A mesh of fewer triangles in place of a large one, in a fraction of a second.

#include <cstddef>
#include <stop_token>

#include "qjulia/mesh/mesh.hpp"

namespace qjulia::shape {

struct CoarseMesh {
  TriangleMesh mesh;
  double cell = 0;  ///< side of a cell, the mesh's units; details smaller than this are lost
};

/// Replaces all vertices in a cubic cell by their mean (Rossignac and Borrel 1993). Triangles
/// between the same three cells cancel in pairs of opposite windings, so that a closed mesh stays
/// closed; if more than one is left, they coincide. Cells are about as small as they can be with
/// `most` triangles or fewer: the mesh usually has at least half of `most`.
/// @throws Interrupted; InputError when the mesh has no area.
CoarseMesh coarse_mesh(const TriangleMesh& mesh, std::size_t most,
                       const std::stop_token& stop = {});

}  // namespace qjulia::shape
