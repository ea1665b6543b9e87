#pragma once
/// What is found out about a mesh.

#include <stop_token>
#include <string>

#include "qjulia/mesh.hpp"

namespace qjulia::shape {

/// Fills in what `qjulia::inspect` tells; what reading the file has found stays.
/// @throws Interrupted.
void inspect(const TriangleMesh& mesh, MeshReport& report, const std::stop_token& stop);

/// Why a mesh of this box is too large or too small to compute with, and what to do; empty when it
/// is neither.
std::string size_problem(const Box& box);

}  // namespace qjulia::shape
