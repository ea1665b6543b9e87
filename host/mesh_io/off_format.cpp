/// Geomview's .off in text, with or without colours, normals and texture coordinates.

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "mesh_io/formats.hpp"
#include "mesh_io/record_stream.hpp"

namespace qjulia::shape {
namespace {

/// Takes "OFF" or the like off the front. Some files have no blank between it and the counts.
bool take_header(std::string_view& text) {
  constexpr std::array kHeaders = {"off",   "coff",   "noff",   "cnoff",
                                   "stoff", "stcoff", "stnoff", "stcnoff"};
  std::string_view rest = text;
  std::string_view word = take_word(rest);
  if (word.starts_with("OFF") && word.size() > 3 && word[3] >= '0' && word[3] <= '9') {
    text.remove_prefix(3);
    return true;
  }
  text = rest;
  return std::ranges::any_of(kHeaders, [&](const char* header) { return is_word(word, header); });
}

/// The counts of vertices and faces, on the header's line or the next.
std::pair<std::size_t, std::size_t> counts(const MeshFile& file, Lines& lines) {
  std::string_view rest = lines.next().value_or("");
  if (!take_header(rest)) {
    file.refuse_type("it does not begin with OFF; is it an .off file of three dimensions?");
  }
  std::string_view word = take_word(rest);
  if (word == "BINARY") file.refuse("binary .off is not supported; export it as text or as .ply");
  if (word.empty()) {
    rest = lines.next().value_or("");
    word = take_word(rest);
  }
  const auto vertices = to_integer(word);
  const auto faces = to_integer(take_word(rest));
  if (!vertices || !faces || *vertices < 0 || *faces < 0) {
    file.refuse("the counts of vertices and faces after OFF are not numbers");
  }
  // A vertex takes at least "0 0 0\n", a face at least "3 0 1 2\n"; the last line end may be
  // missing.
  const auto left = static_cast<long long>(lines.rest().size()) + 1;
  if (*vertices > left / 6 || *faces > left / 8 || *vertices * 6 + *faces * 8 > left) {
    file.refuse(
        fmt::format("it promises {} vertices and {} faces but is too short for them; it may "
                    "be cut off, export it again",
                    *vertices, *faces));
  }
  return {static_cast<std::size_t>(*vertices), static_cast<std::size_t>(*faces)};
}

FaceList read_off(const MeshFile& file, const std::string* /*share*/) {
  Lines lines(file.text());
  const auto [vertices, faces] = counts(file, lines);
  if (faces == 0) file.refuse("it has no faces; export a mesh with faces");
  const auto next_line = [&] {
    const auto line = lines.next();
    if (!line) file.refuse("the file ends too early; it may be cut off, export it again");
    return *line;
  };
  FaceList mesh(file);
  for (std::size_t i = 0; i < vertices; ++i) {
    std::string_view rest = next_line();
    const auto point = take_point(rest);
    if (!point) {
      file.refuse_line(lines.number(), "a vertex needs three finite numbers; export it again");
    }
    mesh.add_vertex(*point);
  }
  std::vector<std::uint32_t> corners;
  for (std::size_t i = 0; i < faces; ++i) {
    std::string_view rest = next_line();
    const auto count = to_integer(take_word(rest));
    if (!count || *count < 3) {
      file.refuse_line(lines.number(), "a face needs a count of three or more vertices");
    }
    corners.clear();
    for (long long corner = 0; corner < *count; ++corner) {
      const std::string_view word = take_word(rest);
      const auto index = to_integer(word);
      if (!index || *index < 0 || *index >= static_cast<long long>(vertices)) {
        file.refuse_line(lines.number(),
                         fmt::format("'{}' does not name one of the {} vertices, counted from 0; "
                                     "export the mesh again",
                                     word, vertices));
      }
      corners.push_back(static_cast<std::uint32_t>(*index));
    }
    mesh.add_face(corners);
  }
  return mesh;
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

bool looks_like_off(std::string_view head) {
  const std::string_view word = take_word(head);
  return (word == "OFF" || word == "COFF" || word == "NOFF") && to_integer(take_word(head));
}

}  // namespace

MeshFormat off_format() {
  return {.seems = "an .off file",
          .looks_like = looks_like_off,
          .read = read_off,
          .write = [](const TriangleMesh& mesh, const MeshWriting& how, std::ostream& out) {
            write_off(mesh, how.options.file_turn(), out);
          }};
}

}  // namespace qjulia::shape
