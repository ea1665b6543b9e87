#pragma once
/// The formats of mesh files: how each is read and written, and what it can say.

#include <filesystem>
#include <iosfwd>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "base/mesh_formats.hpp"
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
  std::string_view extension{};  ///< of `QJULIA_MESH_FORMATS`
  /// What a file that `looks_like` this format seems to be, as in "a .ply file".
  std::string_view seems{};
  /// Whether a file with this beginning seems to have this format; the first format of the list
  /// that says so is taken. Null: it is not read.
  bool (*looks_like)(std::string_view head) = nullptr;
  bool may_be_another = false;        ///< a file that looks like this may hold no mesh
  bool begins_with_anything = false;  ///< a file that looks like another may have this format
  /// @param share as for `FaceList::shares`. Null: the format is not read.
  FaceList (*read)(const MeshFile& file, const std::string* share) = nullptr;
  /// Null: the format is not written.
  void (*write)(const TriangleMesh& mesh, const MeshWriting& how, std::ostream& out) = nullptr;
  std::optional<UpAxis> up{};  ///< the axis that points up; none where the format defines none
  bool has_colors = false;     ///< written with the colours of vertices
  bool has_texture = false;    ///< written with pictures
};

/// obj_format() and so on. Each stands beside the format's writer, or its reader where none is
/// written.
#define QJULIA_FORMAT(name, ending, uses) MeshFormat name##_format();
QJULIA_MESH_FORMATS(QJULIA_FORMAT)
#undef QJULIA_FORMAT

std::span<const MeshFormat> mesh_formats();

/// @throws std::logic_error for an extension that is not in the list
const MeshFormat& mesh_format(std::string_view extension);

}  // namespace qjulia::shape
