#include "mesh_io/ply_format.hpp"

#include <fmt/format.h>

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

}  // namespace qjulia::shape
