#include <fmt/format.h>

#include <cmath>
#include <cstring>

#include "shape/mesh_check.hpp"

namespace qjulia {
namespace {

constexpr std::size_t kHeader = 84;    // 80 bytes of anything, a 32-bit count
constexpr std::size_t kTriangle = 50;  // normal and corners as 12 floats, 2 bytes of anything

/// Triangles promised by a binary file's header.
std::size_t promised(const std::string& bytes) {
  std::uint32_t count = 0;
  if (bytes.size() >= kHeader) std::memcpy(&count, bytes.data() + kHeader - 4, 4);
  return count;
}

void check_binary(const RawMeshFile& file, CheckedMesh& mesh) {
  mesh.is_binary = true;
  mesh.faces = promised(file.bytes);
  for (std::size_t t = 0; t < mesh.faces; ++t) {
    float corners[9];
    std::memcpy(corners, file.bytes.data() + kHeader + t * kTriangle + 12, sizeof corners);
    for (const float coordinate : corners) {
      if (!std::isfinite(coordinate)) {
        file.refuse(
            fmt::format("triangle {} has a coordinate that is not finite; export it again", t + 1));
      }
    }
  }
}

/// Case-blind comparison with a lower-case word.
bool is(std::string_view word, std::string_view lower) {
  return word.size() == lower.size() && std::equal(word.begin(), word.end(), lower.begin(),
                                                   [](char a, char b) { return (a | 0x20) == b; });
}

void check_text(const RawMeshFile& file, CheckedMesh& mesh) {
  Lines lines(file.bytes, '\0');
  int corners = -1;  // of the loop being read; -1 between loops
  bool ended = false;
  while (const auto line = lines.next()) {
    std::string_view rest = *line;
    const std::string_view key = take_word(rest);
    if (is(key, "endsolid")) ended = true;
    if (is(key, "outer")) {
      corners = 0;
      mesh.bytes.append("outer loop\n");
    } else if (is(key, "vertex")) {
      const std::string_view point = rest;
      if (!take_point(rest) || corners < 0 || ++corners > 3) {
        file.refuse_line(lines.number(), "expected three finite numbers and three vertices a loop");
      }
      mesh.bytes.append("vertex").append(point).push_back('\n');
    } else if (is(key, "endloop")) {
      if (corners != 3) file.refuse_line(lines.number(), "a facet needs three vertices");
      corners = -1;
      ++mesh.faces;
    }
  }
  if (!ended || corners >= 0) {
    file.refuse("the closing 'endsolid' is missing; the file may be cut off, export it again");
  }
}

}  // namespace

CheckedMesh check_stl(RawMeshFile file) {
  CheckedMesh mesh;
  if (file.bytes.size() >= kHeader &&
      file.bytes.size() == kHeader + promised(file.bytes) * kTriangle) {
    check_binary(file, mesh);
    mesh.bytes = std::move(file.bytes);
  } else if (file.bytes.starts_with("solid")) {
    check_text(file, mesh);
  } else {
    file.refuse(
        fmt::format("its header promises {} triangles, which {} bytes do not hold; it may be "
                    "cut off or no .stl file, export it again",
                    promised(file.bytes), file.bytes.size()));
  }
  if (mesh.faces == 0) file.refuse("it has no triangles; export a mesh with triangles");
  return mesh;
}

}  // namespace qjulia
