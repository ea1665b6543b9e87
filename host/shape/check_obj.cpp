#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "shape/mesh_check.hpp"

namespace qjulia {
namespace {

/// Vertices of one `f` line, from 0. "3", "3/1", "3//2" and "3/1/2" name vertex 3; negative
/// numbers count back from the last vertex so far.
std::vector<long long> face_vertices(const RawMeshFile& file, const Lines& lines,
                                     std::string_view rest, std::size_t vertices_so_far) {
  std::vector<long long> vertices;
  for (auto word = take_word(rest); !word.empty(); word = take_word(rest)) {
    const auto index = to_integer(word.substr(0, word.find('/')));
    if (!index || *index == 0) {
      file.refuse_line(lines.number(), fmt::format("'{}' is not a vertex number; .obj counts "
                                                   "vertices from 1. Export the mesh again",
                                                   word));
    }
    vertices.push_back(*index > 0 ? *index - 1 : static_cast<long long>(vertices_so_far) + *index);
  }
  if (vertices.size() < 3) {
    file.refuse_line(lines.number(),
                     "a face needs three vertices; the file may be cut off, export it again");
  }
  return vertices;
}

bool has_three_different(std::vector<long long> vertices) {
  std::ranges::sort(vertices);
  return std::unique(vertices.begin(), vertices.end()) - vertices.begin() >= 3;
}

}  // namespace

CheckedMesh check_obj(const RawMeshFile& file) {
  CheckedMesh mesh;
  long long last_index = -1;
  std::size_t last_index_line = 0;
  Lines lines(file.bytes);
  while (const auto line = lines.next()) {
    std::string_view rest = *line;
    const std::string_view key = take_word(rest);
    if (key != "v" && key != "f") continue;
    if (line->ends_with('\\')) {
      file.refuse_line(lines.number(), "it goes on in the next line; write it in one line");
    }
    if (key == "v") {
      if (!take_point(rest)) {
        file.refuse_line(lines.number(), "a vertex needs three finite numbers; export it again");
      }
      ++mesh.vertices;
      mesh.bytes.append(*line).push_back('\n');
      continue;
    }
    const auto vertices = face_vertices(file, lines, rest, mesh.vertices);
    const auto [least, greatest] = std::ranges::minmax(vertices);
    if (least < 0) {
      file.refuse_line(lines.number(), "a vertex number counts back past the first vertex");
    }
    if (greatest > last_index) {
      last_index = greatest;
      last_index_line = lines.number();
    }
    if (!has_three_different(vertices)) {
      ++mesh.dropped_faces;
      continue;
    }
    ++mesh.faces;
    mesh.bytes.append("f");
    for (const long long vertex : vertices)
      fmt::format_to(std::back_inserter(mesh.bytes), " {}", vertex + 1);
    mesh.bytes.push_back('\n');
  }
  if (mesh.vertices == 0) file.refuse("it has no vertices; is it a Wavefront .obj file?");
  if (mesh.faces + mesh.dropped_faces == 0)
    file.refuse("it has no faces; export a mesh with faces");
  if (last_index >= static_cast<long long>(mesh.vertices)) {
    file.refuse_line(last_index_line,
                     fmt::format("a face names vertex {}, but there are {}; export the mesh again",
                                 last_index + 1, mesh.vertices));
  }
  return mesh;
}

}  // namespace qjulia
