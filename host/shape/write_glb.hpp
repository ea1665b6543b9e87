#pragma once

#include <ostream>

#include "qjulia/mesh.hpp"

namespace qjulia::shape {

/// Binary glTF 2.0: one mesh of one primitive, Y up as viewers expect (the mesh's own Z by a node
/// turned a quarter). https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html
/// @param note stands under asset.extras.made_with, unless empty.
/// @throws OutputError beyond 4 GiB, which the format cannot hold.
void write_glb(const TriangleMesh& mesh, const std::string& note, std::ostream& out);

}  // namespace qjulia::shape
