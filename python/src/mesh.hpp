#pragma once
/// Meshes between NumPy, files and the library.

#include <pybind11/pybind11.h>

#include "qjulia/mesh/mesh.hpp"

namespace qjulia::python {

/// (vertices, faces, normals) as arrays; normals are None where the mesh has none.
pybind11::tuple arrays_of(TriangleMesh mesh);

void add_mesh(pybind11::module_& module);

}  // namespace qjulia::python
