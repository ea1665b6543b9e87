#pragma once
/// OpenMesh's readers and writers on plain lists of triangles. Its own meshes drop or split what is
/// not manifold; these lists keep everything. Coordinates pass through single precision.

#include <ostream>
#include <string>

#include "qjulia/mesh.hpp"
#include "shape/mesh_check.hpp"

namespace qjulia {

/// Polygons are cut into fans. @param extension with its dot, such as ".ply".
/// @return false when OpenMesh found other counts than `checked` says.
bool read_with_openmesh(const CheckedMesh& checked, const std::string& extension,
                        TriangleMesh& mesh);

/// @return false when OpenMesh could not write.
bool write_with_openmesh(const TriangleMesh& mesh, const std::string& extension, std::ostream& out);

}  // namespace qjulia
