#pragma once
#include <ostream>
#include <string>

#include "qjulia/mesh/mesh.hpp"

namespace qjulia::shape {

/// 3MF: a ZIP archive with the model as XML, in millimetres, Z up, each body an object and all of
/// them together on the plate. https://3mf.io/spec (core 1.2.3, materials 1.1)
/// A body is a connected part with those that are cavities in it. Vertices without triangles are
/// left out. Colours, sRGB, are a colour group of the materials extension.
/// Memory: 8 bytes a triangle and 12 a vertex, and with colours up to 4 a vertex more.
/// @param note stands as the model's description, unless empty. @param turn the mesh is turned by
/// it. @param scale millimetres in a unit of the mesh. @param out is empty, and can be sought in.
void write_3mf(const TriangleMesh& mesh, const std::string& name, const std::string& note,
               const Eigen::Matrix3d& turn, double scale, std::ostream& out);

}  // namespace qjulia::shape
