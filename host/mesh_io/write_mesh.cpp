#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "base/file_types.hpp"
#include "base/output_file.hpp"
#include "base/range_check.hpp"
#include "mesh_io/formats.hpp"
#include "mesh_io/obj_format.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/mesh/mesh.hpp"
#include "qjulia/mesh/texture.hpp"

namespace qjulia {
namespace {

bool is_mesh(const std::filesystem::path& path) {
  return base::has_type(path, base::FileContent::mesh, base::FileUse::read) ||
         base::has_type(path, base::FileContent::mesh, base::FileUse::write);
}

/// The file of an .obj's material: for colours, unless `path` does not stand for a file of its own
/// or the name does not fit in a line. Empty: none.
std::filesystem::path obj_material_file(const TriangleMesh& mesh,
                                        const std::filesystem::path& path) {
  const auto material = std::filesystem::path(path).replace_extension(".mtl");
  const bool fits =
      std::ranges::none_of(material.filename().string(), [](unsigned char c) { return c < ' '; });
  return !mesh.colors.empty() && fits && !base::is_special(path) ? material
                                                                 : std::filesystem::path();
}

/// @param texture null: none
void write(const TriangleMesh& mesh, const MeshTexture* texture, const std::filesystem::path& path,
           const MeshFileOptions& options) {
  const std::string extension =
      base::expect_type(path, base::FileContent::mesh, base::FileUse::write);
  mesh.validate();
  options.validate();
  if (texture != nullptr && !holds_textures(path)) {
    throw InputError(fmt::format("'{}': a textured mesh is written as .glb", path.string()));
  }
  base::OutputFile file(path);
  const std::filesystem::path material =
      extension == ".obj" ? obj_material_file(mesh, path) : std::filesystem::path();
  const shape::MeshWriting how{options, options.name.empty() ? path.stem().string() : options.name,
                               material.filename().string(), texture};
  shape::mesh_format(extension).write(mesh, how, file.stream());
  if (!file.stream()) {
    throw OutputError(fmt::format("cannot write mesh '{}'; check the space left", path.string()));
  }
  if (!material.empty()) base::write_file(material, shape::obj_material(mesh));
  file.commit();
}

}  // namespace

Eigen::Matrix3d MeshFileOptions::file_turn() const {
  if (!file_up) return Eigen::Matrix3d::Identity();
  return quarter_turns(up.value_or(kDefaultUp), *file_up);
}

void MeshTexture::validate(const TriangleMesh& mesh) const {
  mesh.validate();
  if (mesh.normals.empty()) throw InputError("a textured mesh needs normals");
  if (places.size() != 3 * mesh.triangles.size()) {
    throw InputError(fmt::format("the texture has {} places for {} triangles; give three for each",
                                 places.size(), mesh.triangles.size()));
  }
  for (const Eigen::Vector2f& place : places) {
    const auto is_inside = [](float c) { return c >= 0 && c <= 1; };  // NaN is not
    if (is_inside(place.x()) && is_inside(place.y())) continue;
    throw InputError(
        fmt::format("the texture has a place at {}, {}; give 0 to 1", place.x(), place.y()));
  }
  if (!tangents.empty() && tangents.size() != places.size()) {
    throw InputError(fmt::format("the texture has {} tangents for {} places; give one for each",
                                 tangents.size(), places.size()));
  }
  for (const std::string* png : {&color, &normal}) {
    if (!png->empty() && !png->starts_with("\x89PNG")) {
      throw InputError("a picture of the texture is no .png");
    }
  }
  if (normal.empty()) throw InputError("the texture has no picture of normals");
}

void MeshFileOptions::validate() const {
  if (metres_per_unit) base::expect_positive("metres_per_unit", *metres_per_unit);
}

std::optional<UpAxis> format_up(const std::filesystem::path& path) {
  return is_mesh(path) ? shape::mesh_format(base::extension_of(path)).up : std::nullopt;
}

bool holds_colors(const std::filesystem::path& path) {
  return is_mesh(path) && shape::mesh_format(base::extension_of(path)).has_colors;
}

bool holds_textures(const std::filesystem::path& path) {
  return is_mesh(path) && shape::mesh_format(base::extension_of(path)).has_texture;
}

void write_mesh(const TriangleMesh& mesh, const std::filesystem::path& path,
                const MeshFileOptions& options) {
  write(mesh, nullptr, path, options);
}

void write_textured_mesh(const TriangleMesh& mesh, const MeshTexture& texture,
                         const std::filesystem::path& path, const MeshFileOptions& options) {
  texture.validate(mesh);
  write(mesh, &texture, path, options);
}

void write_mesh(const TriangleMesh& mesh, const std::filesystem::path& path,
                const std::string& note, std::optional<UpAxis> up) {
  write_mesh(mesh, path, MeshFileOptions{.note = note, .up = up});
}

}  // namespace qjulia
