#pragma once
/// Strict checks of mesh files before OpenMesh reads them: its readers pass over numbers that are
/// not finite, indices out of range, missing data and elements they do not know.

#include <string>

#include "shape/mesh_text.hpp"

namespace qjulia {

/// A file OpenMesh reads without loss. Text formats are reduced to vertices and faces.
struct CheckedMesh {
  std::string bytes;
  std::size_t vertices = 0;       ///< that OpenMesh must find; 0 for STL, which names none
  std::size_t faces = 0;          ///< that OpenMesh must find
  std::size_t dropped_faces = 0;  ///< with fewer than three different vertices
  bool is_binary = false;
};

/// Each throws InputError that names the file, where it is wrong and what to do. Nothing larger
/// than the file is allocated, whatever its header promises.
CheckedMesh check_obj(const RawMeshFile& file);
CheckedMesh check_off(const RawMeshFile& file);
CheckedMesh check_ply(const RawMeshFile& file);
CheckedMesh check_stl(RawMeshFile file);

}  // namespace qjulia
