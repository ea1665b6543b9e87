#pragma once
#include <ostream>
#include <string>

#include "qjulia/mesh/mesh.hpp"
#include "qjulia/mesh/moving_mesh.hpp"

namespace qjulia::shape {

/// Universal Scene Description as text (.usda 1.0), Y up: a mesh with its normals, colours and a
/// material that shows them, turned by its transform so that `up` is up, and a camera that sees all
/// of it. https://openusd.org/release/spec.html
/// Colours are linear, as the format wants them.
/// @param name of the model; what is no letter or digit becomes an underscore in names of prims.
/// @param note stands as the layer's documentation, unless empty. @param metres in a unit.
void write_usd(const TriangleMesh& mesh, const std::string& name, const std::string& note,
               UpAxis up, double metres, std::ostream& out);

/// The same with a transform for each body, which has a time sample for each moment.
void write_moving_usd(const MovingMesh& moving, const std::string& name, const std::string& note,
                      UpAxis up, double metres, std::ostream& out);

}  // namespace qjulia::shape
