#include <fmt/format.h>

#include "shape/mesh_check.hpp"

namespace qjulia {
namespace {

constexpr const char* kCutOff = "the file ends too early; it may be cut off, export it again";

/// The counts of vertices and faces, on the header's line or the next.
std::pair<std::size_t, std::size_t> counts(const RawMeshFile& file, Lines& lines) {
  auto line = lines.next();
  std::string_view rest = line.value_or("");
  const std::string_view header = take_word(rest);
  if (header != "OFF" && header != "COFF" && header != "NOFF" && header != "CNOFF" &&
      header != "STOFF" && header != "STCOFF" && header != "STNOFF" && header != "STCNOFF") {
    file.refuse("it does not begin with OFF; is it an .off file of three dimensions?");
  }
  std::string_view word = take_word(rest);
  if (word == "BINARY") file.refuse("binary .off is not supported; export it as text or as .ply");
  if (word.empty()) {
    line = lines.next();
    rest = line.value_or("");
    word = take_word(rest);
  }
  const auto vertices = to_integer(word);
  const auto faces = to_integer(take_word(rest));
  if (!vertices || !faces || *vertices < 0 || *faces < 0) {
    file.refuse("the counts of vertices and faces after OFF are not numbers");
  }
  // A vertex takes at least "0 0 0\n", a face at least "3 0 1 2\n", the last line end may lack.
  const auto left = static_cast<long long>(lines.rest().size()) + 1;
  if (*vertices > left / 6 || *faces > left / 8 || *vertices * 6 + *faces * 8 > left) {
    file.refuse(
        fmt::format("it promises {} vertices and {} faces but is too short for them; it may "
                    "be cut off, export it again",
                    *vertices, *faces));
  }
  return {static_cast<std::size_t>(*vertices), static_cast<std::size_t>(*faces)};
}

}  // namespace

CheckedMesh check_off(const RawMeshFile& file) {
  CheckedMesh mesh;
  Lines lines(file.bytes);
  const auto [vertices, faces] = counts(file, lines);
  if (faces == 0) file.refuse("it has no faces; export a mesh with faces");
  mesh.vertices = vertices;
  mesh.faces = faces;
  mesh.bytes = fmt::format("OFF\n{} {} 0\n", vertices, faces);
  for (std::size_t i = 0; i < vertices; ++i) {
    const auto line = lines.next();
    if (!line) file.refuse(kCutOff);
    std::string_view rest = *line;
    if (!take_point(rest)) {
      file.refuse_line(lines.number(), "a vertex needs three finite numbers; export it again");
    }
    mesh.bytes.append(line->substr(0, line->size() - rest.size())).push_back('\n');
  }
  for (std::size_t i = 0; i < faces; ++i) {
    const auto line = lines.next();
    if (!line) file.refuse(kCutOff);
    std::string_view rest = *line;
    const auto corners = to_integer(take_word(rest));
    if (!corners || *corners < 3) {
      file.refuse_line(lines.number(), "a face needs a count of three or more vertices");
    }
    for (long long corner = 0; corner < *corners; ++corner) {
      const std::string_view word = take_word(rest);
      const auto index = to_integer(word);
      if (!index || *index < 0 || *index >= static_cast<long long>(vertices)) {
        file.refuse_line(lines.number(),
                         fmt::format("'{}' does not name one of the {} vertices, counted from 0; "
                                     "export the mesh again",
                                     word, vertices));
      }
    }
    mesh.bytes.append(line->substr(0, line->size() - rest.size())).push_back('\n');
  }
  return mesh;
}

}  // namespace qjulia
