#pragma once
/// Checks of a mesh, and what they find.

#include <span>
#include <stop_token>
#include <string>

#include "qjulia/mesh/mesh.hpp"

namespace qjulia::shape {

/// What `qjulia::inspect` reports, added to what reading the file has found. @throws Interrupted
MeshReport inspect(const TriangleMesh& mesh, MeshReport report, const std::stop_token& stop);

/// @throws InputError naming the vertex that is not finite, or the triangle with an index that no
/// vertex has.
void check_triangles(std::span<const Eigen::Vector3d> vertices,
                     std::span<const Triangle> triangles);

/// Why a mesh of this box is too large or too small to compute with, and what to do; empty when it
/// is neither.
std::string size_problem(const Box& box);

}  // namespace qjulia::shape
