#pragma once
/// Meshes that are cut open.

#include <optional>

#include "qjulia/base/box.hpp"
#include "qjulia/base/cut.hpp"
#include "qjulia/mesh/mesh.hpp"

namespace qjulia {

/// What is left of a mesh below the plane of a cut. Triangles that the plane crosses are cut along
/// it, and edges on it are left open. Normals and colours go along.
/// @param mesh shape units. @param box as `place_of` takes it.
/// @throws OptionError as `place_of`, InputError for a mesh that is none
TriangleMesh cut_away(const TriangleMesh& mesh, const Cut& plane, const std::optional<Box>& box);

}  // namespace qjulia
