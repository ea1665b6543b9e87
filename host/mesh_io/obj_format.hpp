#pragma once
#include <string>

#include "qjulia/mesh/mesh.hpp"

namespace qjulia::shape {

/// The material of an .obj, rough and of the colours' mean, for programs that pass over the colours
/// of vertices.
/// @pre the mesh has colours
std::string obj_material(const TriangleMesh& mesh);

}  // namespace qjulia::shape
