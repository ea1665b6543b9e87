#include "mesh_io/ply_format.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>

#include "mesh_io/formats.hpp"
#include "mesh_io/record_stream.hpp"

namespace qjulia::shape {
namespace {

/// Comments of short lines: readers have limits.
std::string comments(const std::string& note) {
  constexpr std::size_t kLine = 200;
  std::string lines;
  for (std::size_t at = 0; at < note.size(); at += kLine) {
    lines += fmt::format("comment {}\n", note.substr(at, kLine));
  }
  return lines;
}

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

bool looks_like_ply(std::string_view head) {
  return head.starts_with("ply\n") || head.starts_with("ply\r");
}

}  // namespace

std::string ply_header(std::size_t vertices, std::size_t triangles, VertexParts parts,
                       const std::string& note) {
  return fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment made by qjulia\n{}"
      "element vertex {}\nproperty float x\nproperty float y\nproperty float z\n{}{}"
      "element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
      comments(note), vertices,
      parts.normals ? "property float nx\nproperty float ny\nproperty float nz\n" : "",
      parts.colors ? "property uchar red\nproperty uchar green\nproperty uchar blue\n" : "",
      triangles);
}

MeshFormat ply_format() {
  return {.seems = "a .ply file",
          .looks_like = looks_like_ply,
          .read = read_ply,
          .write =
              [](const TriangleMesh& mesh, const MeshWriting& how, std::ostream& out) {
                write_ply(mesh, how.options.note, how.options.file_turn(), out);
              },
          .has_colors = true};
}

}  // namespace qjulia::shape
