#pragma once
#include <ostream>
#include <string>

#include "qjulia/mesh/mesh.hpp"

namespace qjulia::shape {

/// Wavefront .obj: corners are numbered from 1; a normal has the number of its vertex. A colour
/// follows its vertex's coordinates, sRGB from 0 to 1.
/// @param name of the object. @param turn the mesh is turned by it.
/// @param material the file name of its material; empty: none.
void write_obj(const TriangleMesh& mesh, const std::string& name, const std::string& note,
               const Eigen::Matrix3d& turn, const std::string& material, std::ostream& out);

/// A rough material of the colours' mean, for programs that pass over the colours of vertices.
/// @pre the mesh has colours
std::string obj_material(const TriangleMesh& mesh);

}  // namespace qjulia::shape
