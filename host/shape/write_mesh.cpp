#include <fmt/format.h>

#include <Eigen/Geometry>
#include <array>
#include <string>

#include "base/output_file.hpp"
#include "qjulia/error.hpp"
#include "qjulia/file_types.hpp"
#include "qjulia/mesh.hpp"
#include "shape/ply_format.hpp"
#include "shape/record_stream.hpp"
#include "shape/write_glb.hpp"

namespace qjulia {
namespace {

using shape::RecordStream;

void write_ply(const TriangleMesh& mesh, const std::string& note, std::ostream& out) {
  const shape::VertexParts parts{!mesh.normals.empty(), !mesh.colors.empty()};
  out << shape::ply_header(mesh.vertices.size(), mesh.triangles.size(), parts, note);
  RecordStream file(out);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    for (const double c : mesh.vertices[v]) file.add(static_cast<float>(c));
    if (parts.normals) {
      for (const float c : mesh.normals[v]) file.add(c);
    }
    if (parts.colors) file.add(mesh.colors[v]);
  }
  for (const Triangle& t : mesh.triangles) file.add(shape::PlyFace(t));
}

// Nine digits are enough to read the same float back.

/// Corners are numbered from 1; a normal has the number of its vertex. A colour follows its
/// vertex's coordinates, sRGB from 0 to 1.
void write_obj(const TriangleMesh& mesh, const std::string& note, std::ostream& out) {
  RecordStream file(out);
  if (!note.empty()) file.print("# {}\n", note);
  file.print("# {} vertices, {} faces\n", mesh.vertices.size(), mesh.triangles.size());
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const Eigen::Vector3f x = mesh.vertices[v].cast<float>();
    file.print("v {:.9g} {:.9g} {:.9g}", x.x(), x.y(), x.z());
    if (!mesh.colors.empty()) {
      for (const std::uint8_t c : mesh.colors[v]) file.print(" {:.4f}", c / 255.0);
    }
    file.print("\n");
    if (mesh.normals.empty()) continue;
    const Eigen::Vector3f& n = mesh.normals[v];
    file.print("vn {:.9g} {:.9g} {:.9g}\n", n.x(), n.y(), n.z());
  }
  for (const auto& [a, b, c] : mesh.triangles) {
    if (mesh.normals.empty()) {
      file.print("f {} {} {}\n", a + 1, b + 1, c + 1);
    } else {
      file.print("f {0}//{0} {1}//{1} {2}//{2}\n", a + 1, b + 1, c + 1);
    }
  }
}

/// Without normals: many readers of .off know none and refuse a file that starts with "NOFF".
void write_off(const TriangleMesh& mesh, std::ostream& out) {
  RecordStream file(out);
  file.print("OFF\n{} {} 0\n", mesh.vertices.size(), mesh.triangles.size());
  for (const Eigen::Vector3d& vertex : mesh.vertices) {
    const Eigen::Vector3f x = vertex.cast<float>();
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

}  // namespace

bool stands_upright(const std::filesystem::path& path) {
  const std::string extension = extension_of(path);
  return extension == ".glb" || extension == ".stl";
}

bool holds_colors(const std::filesystem::path& path) {
  const std::string extension = extension_of(path);
  return extension == ".ply" || extension == ".obj" || extension == ".glb";
}

void write_mesh(const TriangleMesh& mesh, const std::filesystem::path& path,
                const std::string& note, std::optional<UpAxis> up) {
  const std::string extension = expect_type(path, FileContent::mesh, FileUse::write);
  mesh.validate();
  base::OutputFile file(path);
  if (extension == ".ply") write_ply(mesh, note, file.stream());
  if (extension == ".obj") write_obj(mesh, note, file.stream());
  if (extension == ".off") write_off(mesh, file.stream());
  if (extension == ".stl") {
    write_stl(mesh, quarter_turns(up.value_or(UpAxis::z), UpAxis::z), file.stream());
  }
  if (extension == ".glb") {
    shape::write_glb(mesh, path.stem().string(), note, up.value_or(UpAxis::z), file.stream());
  }
  if (!file.stream()) {
    throw OutputError(fmt::format("cannot write mesh '{}'; check the space left", path.string()));
  }
  file.commit();
}

}  // namespace qjulia
