/// Stereolithography .stl, in text and binary.

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <array>
#include <cstring>

#include "base/input_file.hpp"
#include "mesh_io/formats.hpp"
#include "mesh_io/record_stream.hpp"

namespace qjulia::shape {
namespace {

constexpr std::size_t kHeader = 84;    // 80 bytes of anything, a 32-bit count
constexpr std::size_t kTriangle = 50;  // normal and corners as 12 floats, 2 bytes of anything

/// Triangles promised by a binary file's header.
std::size_t promised(std::string_view bytes) {
  std::uint32_t count = 0;
  if (bytes.size() >= kHeader) std::memcpy(&count, bytes.data() + kHeader - 4, 4);
  return count;
}

void add_triangle(FaceList& mesh, std::span<const Eigen::Vector3f, 3> corners) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const auto& corner : corners) mesh.add_vertex(corner);
  mesh.add_face(std::array{first, first + 1, first + 2});
}

void read_binary(const MeshFile& file, FaceList& mesh) {
  const std::size_t count = promised(file.bytes());
  for (std::size_t t = 0; t < count; ++t) {
    std::array<Eigen::Vector3f, 3> corners;
    std::memcpy(corners[0].data(), file.bytes().data() + kHeader + t * kTriangle + 12,
                sizeof corners);
    for (const auto& corner : corners) {
      if (!corner.allFinite()) {
        file.refuse(
            fmt::format("triangle {} has a coordinate that is not finite; export it again", t + 1));
      }
    }
    add_triangle(mesh, corners);
  }
}

void read_text(const MeshFile& file, FaceList& mesh) {
  Lines lines(file.text(), '\0');
  std::array<Eigen::Vector3f, 3> corners;
  constexpr std::size_t kOutside = 4;
  std::size_t count = kOutside;  // corners of the loop being read so far, or kOutside
  bool ended = false;
  while (const auto line = lines.next()) {
    std::string_view rest = *line;
    for (auto word = take_word(rest); !word.empty(); word = take_word(rest)) {
      if (is_word(word, "endsolid")) ended = true;
      if (is_word(word, "solid") || is_word(word, "endsolid")) break;  // a name follows
      if (is_word(word, "outer")) {
        count = 0;
      } else if (is_word(word, "vertex")) {
        const auto point = take_point(rest);
        if (!point || count >= 3) {
          file.refuse_line(lines.number(),
                           "expected three finite numbers and three vertices a loop");
        }
        corners[count++] = *point;
      } else if (is_word(word, "endloop")) {
        if (count != 3) file.refuse_line(lines.number(), "a facet needs three vertices");
        count = kOutside;
        add_triangle(mesh, corners);
      }
    }
  }
  if (!ended || count != kOutside) {
    file.refuse("the closing 'endsolid' is missing; the file may be cut off, export it again");
  }
}

/// Neither text nor a binary file of the right size.
[[noreturn]] void refuse(const MeshFile& file) {
  const std::size_t size = file.bytes().size();
  if (size < kHeader) {
    file.refuse_type(
        fmt::format("it has {} bytes, fewer than the {} that every .stl file has; it may be "
                    "cut off, export it again",
                    size, kHeader));
  }
  file.refuse_type(fmt::format(
      "it seems to be a binary .stl file, but its header promises {} triangles ({}) and it holds "
      "{} ({}); it may be cut off or damaged, export it again",
      promised(file.bytes()), base::size_text(kHeader + promised(file.bytes()) * kTriangle),
      (size - kHeader) / kTriangle, base::size_text(size)));
}

FaceList read_stl(const MeshFile& file, const std::string* /*share*/) {
  FaceList mesh(file);
  mesh.is_soup = true;
  const std::string_view bytes = file.bytes();
  const std::size_t expected = kHeader + promised(bytes) * kTriangle;
  // Some programs leave a few bytes at the end.
  if (bytes.size() >= expected && bytes.size() < expected + kTriangle) {
    read_binary(file, mesh);
  } else {
    std::string_view text = file.text();
    // Binary files may begin with the word that marks text, but not without a zero byte.
    const bool is_text = is_word(take_word(text), "solid") && text.find('\0') > kHeader;
    if (!is_text) refuse(file);
    read_text(file, mesh);
  }
  if (mesh.faces() == 0) file.refuse("it has no triangles; export a mesh with triangles");
  return mesh;
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

/// In text: a binary file may begin with anything.
bool looks_like_stl(std::string_view head) {
  const bool is_text = head.find('\0') == std::string_view::npos;
  return is_text && is_word(take_word(head), "solid");
}

}  // namespace

MeshFormat stl_format() {
  return {
      .seems = "an .stl file in text",
      .looks_like = looks_like_stl,
      .begins_with_anything = true,
      .read = read_stl,
      .write = [](const TriangleMesh& mesh, const MeshWriting& how,
                  std::ostream& out) { write_stl(mesh, quarter_turns(how.up(), UpAxis::z), out); },
      .up = UpAxis::z};
}

}  // namespace qjulia::shape
