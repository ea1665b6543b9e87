#include "mesh_io/formats.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <ostream>
#include <stdexcept>

#include "mesh_io/ply_format.hpp"
#include "mesh_io/record_stream.hpp"
#include "mesh_io/write_3mf.hpp"
#include "mesh_io/write_glb.hpp"
#include "mesh_io/write_obj.hpp"
#include "mesh_io/write_usd.hpp"

namespace qjulia::shape {
namespace {

void write_ply(const TriangleMesh& mesh, const std::string& note, const Eigen::Matrix3d& turn,
               std::ostream& out) {
  const VertexParts parts{!mesh.normals.empty(), !mesh.colors.empty()};
  out << ply_header(mesh.vertices.size(), mesh.triangles.size(), parts, note);
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
  for (const Triangle& t : mesh.triangles) file.add(PlyFace(t));
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

/// A reader that finds no shares of detail in its files.
template <FaceList (*kRead)(const MeshFile&)>
FaceList without_shares(const MeshFile& file, const std::string* /*share*/) {
  return kRead(file);
}

constexpr double kMillimetres = 1000;  // in a metre

const std::array kFormats = {
    MeshFormat{.extension = ".obj",
               .read = read_obj,
               .write =
                   [](const TriangleMesh& mesh, const MeshWriting& how, std::ostream& out) {
                     write_obj(mesh, how.name, how.options.note, how.options.file_turn(),
                               how.material, out);
                   },
               .has_colors = true},
    MeshFormat{.extension = ".off",
               .read = without_shares<read_off>,
               .write = [](const TriangleMesh& mesh, const MeshWriting& how,
                           std::ostream& out) { write_off(mesh, how.options.file_turn(), out); }},
    MeshFormat{.extension = ".ply",
               .read = read_ply,
               .write =
                   [](const TriangleMesh& mesh, const MeshWriting& how, std::ostream& out) {
                     write_ply(mesh, how.options.note, how.options.file_turn(), out);
                   },
               .has_colors = true},
    MeshFormat{.extension = ".stl",
               .read = without_shares<read_stl>,
               .write =
                   [](const TriangleMesh& mesh, const MeshWriting& how, std::ostream& out) {
                     write_stl(mesh, quarter_turns(how.up(), UpAxis::z), out);
                   },
               .up = UpAxis::z},
    MeshFormat{.extension = ".glb",
               .read = without_shares<read_gltf>,
               .write =
                   [](const TriangleMesh& mesh, const MeshWriting& how, std::ostream& out) {
                     write_glb(mesh, how.name, how.options.note, how.up(),
                               how.options.metres_per_unit.value_or(1), how.options.map,
                               how.texture, out);
                   },
               .up = UpAxis::y,
               .has_colors = true,
               .has_texture = true},
    MeshFormat{.extension = ".gltf", .read = without_shares<read_gltf>, .up = UpAxis::y},
    MeshFormat{.extension = ".3mf",
               .read = without_shares<read_3mf>,
               .write =
                   [](const TriangleMesh& mesh, const MeshWriting& how, std::ostream& out) {
                     const auto& metres = how.options.metres_per_unit;
                     write_3mf(mesh, how.name, how.options.note, quarter_turns(how.up(), UpAxis::z),
                               metres ? kMillimetres * *metres : 1, out);
                   },
               .up = UpAxis::z,
               .has_colors = true},
    MeshFormat{.extension = ".usda",
               .write =
                   [](const TriangleMesh& mesh, const MeshWriting& how, std::ostream& out) {
                     write_usd(mesh, how.name, how.options.note, how.up(),
                               how.options.metres_per_unit.value_or(1), out);
                   },
               .up = UpAxis::y,
               .has_colors = true},
};

}  // namespace

const MeshFormat& mesh_format(std::string_view extension) {
  const auto* found = std::ranges::find(kFormats, extension, &MeshFormat::extension);
  if (found == kFormats.end()) {
    throw std::logic_error(
        "the table of file types has a mesh that nothing here reads or writes: " +
        std::string(extension));
  }
  return *found;
}

}  // namespace qjulia::shape
