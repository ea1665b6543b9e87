#pragma once
/// The formats of mesh files: how each is read and written, and what it can say.

#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string>
#include <string_view>

#include "mesh_io/mesh_file.hpp"
#include "qjulia/mesh/mesh.hpp"
#include "qjulia/mesh/texture.hpp"

namespace qjulia::shape {

/// What writers get besides the mesh.
struct MeshWriting {
  const MeshFileOptions& options;
  std::string name;        ///< the object's
  std::string material{};  ///< the file name of an .obj's material; empty: none
  const MeshTexture* texture = nullptr;
  UpAxis up() const { return options.up.value_or(UpAxis::z); }
};

struct MeshFormat {
  std::string_view extension;
  /// @param share as for `read_obj` and `read_ply`. Null: the format is not read.
  FaceList (*read)(const MeshFile& file, const std::string* share) = nullptr;
  /// Null: the format is not written.
  void (*write)(const TriangleMesh& mesh, const MeshWriting& how, std::ostream& out) = nullptr;
  std::optional<UpAxis> up{};  ///< the axis that points up; none where the format defines none
  bool has_colors = false;     ///< written with the colours of vertices
  bool has_texture = false;    ///< written with pictures
};

/// The format of a mesh file. @pre the table of file types has the extension as a mesh
const MeshFormat& mesh_format(std::string_view extension);

}  // namespace qjulia::shape
