#pragma once
#include <ostream>
#include <string>

#include "qjulia/mesh/mesh.hpp"
#include "qjulia/mesh/moving_mesh.hpp"
#include "qjulia/mesh/texture.hpp"

namespace qjulia::shape {

/// Binary glTF 2.0: one mesh of one primitive, Y up as the format wants it: the node is turned so
/// that the mesh's `up` is. https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html
/// Colours are linear, as the format wants them, and have a material that shows them as they are.
/// @param note stands under asset.extras.made_with, unless empty. @param scale of the node: metres
/// in a unit of the mesh. @param map stands in a chunk of its own after the buffer, unless empty.
/// @param texture null: none. With one, vertices are written for each triangle anew, because each
/// has places of its own in the pictures, and colours are left out.
/// @throws OutputError beyond 4 GiB, which the format cannot hold.
void write_glb(const TriangleMesh& mesh, const std::string& name, const std::string& note,
               UpAxis up, double scale, const std::string& map, const MeshTexture* texture,
               std::ostream& out);

/// The same with a node for each body, under a node that turns all of them, and one animation with
/// places and turns of the bodies that move.
void write_moving_glb(const MovingMesh& moving, const std::string& name, const std::string& note,
                      UpAxis up, double scale, const std::string& map, std::ostream& out);

}  // namespace qjulia::shape
