#pragma once
/// A mesh as cells of one size see it.

#include <stop_token>

#include "qjulia/device/device.hpp"
#include "qjulia/mesh/mesh.hpp"

namespace qjulia {

/// Marching cubes of the mesh's signed distance: what is smaller than a cell is lost, and what is
/// left is closed.
/// @param cells along the longest side, 16 … 1024.
/// @throws InputError for a mesh that is none, or has no inside that cells of this size see;
///   OptionError naming `cells`; Interrupted.
TriangleMesh cell_mesh(const Device& device, const TriangleMesh& mesh, int cells,
                       const std::stop_token& stop = {});

}  // namespace qjulia
