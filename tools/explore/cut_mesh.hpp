#pragma once
/// Meshes cut open.

#include "qjulia/mesh.hpp"

namespace qjulia::explore {

/// What of the mesh lies below the plane at `most` across an axis (0, 1, 2): triangles that the
/// plane crosses are cut along it, and edges on it are left open. Normals go along.
TriangleMesh cut_away(const TriangleMesh& mesh, int axis, double most);

}  // namespace qjulia::explore
