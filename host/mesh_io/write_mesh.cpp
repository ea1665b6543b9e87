#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>

#include "base/file_types.hpp"
#include "base/output_file.hpp"
#include "base/range_check.hpp"
#include "mesh_io/ply_format.hpp"
#include "mesh_io/record_stream.hpp"
#include "mesh_io/write_3mf.hpp"
#include "mesh_io/write_glb.hpp"
#include "mesh_io/write_obj.hpp"
#include "mesh_io/write_usd.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/mesh/mesh.hpp"

namespace qjulia {
namespace {

using shape::RecordStream;

void write_ply(const TriangleMesh& mesh, const std::string& note, const Eigen::Matrix3d& turn,
               std::ostream& out) {
  const shape::VertexParts parts{!mesh.normals.empty(), !mesh.colors.empty()};
  out << shape::ply_header(mesh.vertices.size(), mesh.triangles.size(), parts, note);
  RecordStream file(out);
  const Eigen::Matrix3f turn_normal = turn.cast<float>();
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const Eigen::Vector3d x = turn * mesh.vertices[v];
    for (const double c : x) file.add(static_cast<float>(c));
    if (parts.normals) {
      const Eigen::Vector3f normal = turn_normal * mesh.normals[v];
      for (const float c : normal) file.add(c);
    }
    if (parts.colors) file.add(mesh.colors[v]);
  }
  for (const Triangle& t : mesh.triangles) file.add(shape::PlyFace(t));
}

/// Without normals: many readers of .off know none and refuse a file that starts with "NOFF".
void write_off(const TriangleMesh& mesh, const Eigen::Matrix3d& turn, std::ostream& out) {
  RecordStream file(out);
  file.print("OFF\n{} {} 0\n", mesh.vertices.size(), mesh.triangles.size());
  for (const Eigen::Vector3d& vertex : mesh.vertices) {
    const Eigen::Vector3f x = (turn * vertex).cast<float>();
    file.print("{:.9g} {:.9g} {:.9g}\n", x.x(), x.y(), x.z());
  }
  for (const auto& [a, b, c] : mesh.triangles) file.print("3 {} {} {}\n", a, b, c);
}

/// Binary: each triangle with its normal and its corners, turned by `turn`.
void write_stl(const TriangleMesh& mesh, const Eigen::Matrix3d& turn, std::ostream& out) {
  RecordStream file(out);
  std::string title = "binary stl file";
  title.resize(79, ' ');
  title.push_back('\0');  // readers take 80 bytes, and some a string
  file.print("{}", title);
  file.add(static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const Triangle& triangle : mesh.triangles) {
    std::array<Eigen::Vector3f, 3> x;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const Eigen::Vector3d turned = turn * mesh.vertices[triangle[i]];
      x[i] = turned.cast<float>();
    }
    const Eigen::Vector3f normal = (x[2] - x[1]).cross(x[0] - x[1]).normalized();
    for (const Eigen::Vector3f& vector : {normal, x[0], x[1], x[2]}) {
      for (const float c : vector) file.add(c);
    }
    file.add(std::uint16_t{0});  // bytes of attributes
  }
}

/// All but .obj, which may have a second file.
void write_contents(const TriangleMesh& mesh, const std::string& extension,
                    const MeshFileOptions& options, std::ostream& out) {
  const UpAxis up = options.up.value_or(UpAxis::z);
  const double metres = options.metres_per_unit.value_or(1);
  const Eigen::Matrix3d turn = options.file_turn();
  if (extension == ".ply") {
    write_ply(mesh, options.note, turn, out);
  } else if (extension == ".off") {
    write_off(mesh, turn, out);
  } else if (extension == ".stl") {
    write_stl(mesh, quarter_turns(up, UpAxis::z), out);
  } else if (extension == ".glb") {
    shape::write_glb(mesh, options.name, options.note, up, metres, options.map, out);
  } else if (extension == ".usda") {
    shape::write_usd(mesh, options.name, options.note, up, metres, out);
  } else if (extension == ".3mf") {
    constexpr double kMillimetres = 1000;  // in a metre
    const double scale = options.metres_per_unit ? kMillimetres * metres : 1;
    shape::write_3mf(mesh, options.name, options.note, quarter_turns(up, UpAxis::z), scale, out);
  } else {
    throw std::logic_error("the table of file types has a mesh that nothing here writes: " +
                           extension);
  }
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

}  // namespace

Eigen::Matrix3d MeshFileOptions::file_turn() const {
  if (!file_up) return Eigen::Matrix3d::Identity();
  return quarter_turns(up.value_or(kDefaultUp), *file_up);
}

void MeshFileOptions::validate() const {
  if (metres_per_unit) base::expect_positive("metres_per_unit", *metres_per_unit);
}

std::optional<UpAxis> format_up(const std::filesystem::path& path) {
  const std::string extension = base::extension_of(path);
  if (extension == ".glb" || extension == ".gltf" || extension == ".usda") return UpAxis::y;
  if (extension == ".stl" || extension == ".3mf") return UpAxis::z;
  return {};
}

bool holds_colors(const std::filesystem::path& path) {
  const std::string extension = base::extension_of(path);
  return extension == ".ply" || extension == ".obj" || extension == ".glb" || extension == ".3mf" ||
         extension == ".usda";
}

void write_mesh(const TriangleMesh& mesh, const std::filesystem::path& path,
                const MeshFileOptions& given) {
  const std::string extension =
      base::expect_type(path, base::FileContent::mesh, base::FileUse::write);
  mesh.validate();
  given.validate();
  MeshFileOptions options = given;
  if (options.name.empty()) options.name = path.stem().string();
  base::OutputFile file(path);
  std::filesystem::path material;
  if (extension == ".obj") {
    material = obj_material_file(mesh, path);
    shape::write_obj(mesh, options.name, options.note, options.file_turn(),
                     material.filename().string(), file.stream());
  } else {
    write_contents(mesh, extension, options, file.stream());
  }
  if (!file.stream()) {
    throw OutputError(fmt::format("cannot write mesh '{}'; check the space left", path.string()));
  }
  if (!material.empty()) base::write_file(material, shape::obj_material(mesh));
  file.commit();
}

void write_mesh(const TriangleMesh& mesh, const std::filesystem::path& path,
                const std::string& note, std::optional<UpAxis> up) {
  write_mesh(mesh, path, MeshFileOptions{.note = note, .up = up});
}

}  // namespace qjulia
