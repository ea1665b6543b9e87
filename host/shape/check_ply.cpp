#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "shape/mesh_check.hpp"
#include "shape/ply_header.hpp"

namespace qjulia {
namespace {

/// The values of a PLY body, one after the other, as text or as bytes.
class PlyBody {
 public:
  PlyBody(const RawMeshFile& file, const PlyHeader& header)
      : file_(file),
        is_text_(header.format == PlyFormat::text),
        swap_((header.format == PlyFormat::little_endian) !=
              (std::endian::native == std::endian::little)),
        rest_(std::string_view(file.bytes).substr(header.body)) {}

  /// Refuses the file when `count` rows of an element cannot be in what is left.
  void expect_rows(const PlyElement& element) const;

  double next(PlyType type) { return is_text_ ? next_word() : next_bytes(type); }
  /// A finite coordinate, an index or the length of a list.
  double next_coordinate(PlyType type);
  std::int64_t next_integer(PlyType type, std::int64_t least, std::int64_t most, const char* what);

 private:
  double next_word();
  double next_bytes(PlyType type);
  [[noreturn]] void refuse_end() const {
    file_.refuse("the file ends too early; it may be cut off, export it again");
  }

  const RawMeshFile& file_;
  bool is_text_;
  bool swap_;
  std::string_view rest_;
};

void PlyBody::expect_rows(const PlyElement& element) const {
  std::size_t row = 0;  // least bytes of one: a digit and a blank a value, where lists are empty
  for (const auto& property : element.properties) {
    row += is_text_ ? 2 : size_of(property.is_list ? property.count_type : property.type);
  }
  if (row > 0 && element.count > (rest_.size() + 1) / row) {
    file_.refuse(
        fmt::format("its header promises {} of '{}' but only {} bytes follow; it may be cut "
                    "off, export it again",
                    element.count, element.name, rest_.size()));
  }
}

double PlyBody::next_word() {
  const std::string_view word = take_word(rest_);
  if (word.empty()) refuse_end();
  // What is no number, such as "nan" for an unknown normal, is refused only where it matters.
  return to_coordinate(word).value_or(std::numeric_limits<double>::quiet_NaN());
}

double PlyBody::next_bytes(PlyType type) {
  const std::size_t size = size_of(type);
  if (rest_.size() < size) refuse_end();
  char bytes[8];
  std::ranges::copy(rest_.substr(0, size), bytes);
  rest_.remove_prefix(size);
  if (swap_) std::reverse(bytes, bytes + size);
  const auto as = [&bytes]<class T>(T value) {
    std::memcpy(&value, bytes, sizeof value);
    return static_cast<double>(value);
  };
  switch (type) {
    case PlyType::int8:
      return as(std::int8_t{});
    case PlyType::uint8:
      return as(std::uint8_t{});
    case PlyType::int16:
      return as(std::int16_t{});
    case PlyType::uint16:
      return as(std::uint16_t{});
    case PlyType::int32:
      return as(std::int32_t{});
    case PlyType::uint32:
      return as(std::uint32_t{});
    case PlyType::float32:
      return as(float{});
    case PlyType::float64:
      return as(double{});
  }
  return 0;
}

double PlyBody::next_coordinate(PlyType type) {
  const double value = next(type);
  if (!(std::abs(value) <= std::numeric_limits<float>::max())) {
    file_.refuse("a vertex has a coordinate that is not a finite number; export it again");
  }
  return value;
}

std::int64_t PlyBody::next_integer(PlyType type, std::int64_t least, std::int64_t most,
                                   const char* what) {
  const double value = next(type);
  if (!(value >= static_cast<double>(least) && value <= static_cast<double>(most)) ||
      value != std::floor(value)) {
    file_.refuse(
        fmt::format("{} is {}, not one of {} to {}; export it again", what, value, least, most));
  }
  return static_cast<std::int64_t>(value);
}

template <class T>
void append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// Copies the coordinates of every vertex.
void copy_vertices(PlyBody& body, const PlyElement& element, CheckedMesh& mesh) {
  for (std::size_t i = 0; i < element.count; ++i) {
    std::array<float, 3> x{};
    for (const auto& property : element.properties) {
      if (property.is_list) {
        for (auto n = body.next_integer(property.count_type, 0, INT32_MAX, "a list's length");
             n > 0; --n) {
          body.next(property.type);
        }
      } else if (property.name.size() == 1 && property.name[0] >= 'x' && property.name[0] <= 'z') {
        x[static_cast<std::size_t>(property.name[0] - 'x')] =
            static_cast<float>(body.next_coordinate(property.type));
      } else {
        body.next(property.type);
      }
    }
    append(mesh.bytes, x);
  }
}

bool is_corner_list(const PlyProperty& property) {
  return property.is_list && (property.name == "vertex_indices" || property.name == "vertex_index");
}

/// Copies the vertex indices of every face.
void copy_faces(PlyBody& body, const PlyElement& element, CheckedMesh& mesh) {
  const auto last = static_cast<std::int64_t>(mesh.vertices) - 1;
  for (std::size_t i = 0; i < element.count; ++i) {
    for (const auto& property : element.properties) {
      const bool is_corners = is_corner_list(property);
      std::int64_t n = 1;
      if (property.is_list) {
        n = body.next_integer(property.count_type, is_corners ? 3 : 0, INT32_MAX,
                              "a list's length");
      }
      if (is_corners) append(mesh.bytes, static_cast<std::int32_t>(n));
      for (; n > 0; --n) {
        if (!is_corners) {
          body.next(property.type);
          continue;
        }
        append(mesh.bytes, static_cast<std::int32_t>(
                               body.next_integer(property.type, 0, last, "a face's vertex")));
      }
    }
  }
}

void skip_rows(PlyBody& body, const PlyElement& element) {
  for (std::size_t i = 0; i < element.count; ++i) {
    for (const auto& property : element.properties) {
      std::int64_t n = 1;
      if (property.is_list)
        n = body.next_integer(property.count_type, 0, INT32_MAX, "a list's length");
      for (; n > 0; --n) body.next(property.type);
    }
  }
}

/// The element of that name, which must have `property` and at least one row.
const PlyElement& find_element(const RawMeshFile& file, const PlyHeader& header, const char* name,
                               const char* missing) {
  const auto found = std::ranges::find(header.elements, name, &PlyElement::name);
  if (found == header.elements.end() || found->count == 0) file.refuse(missing);
  return *found;
}

}  // namespace

CheckedMesh check_ply(const RawMeshFile& file) {
  const PlyHeader header = read_ply_header(file);
  if (std::ranges::count(header.elements, "tristrips", &PlyElement::name) > 0) {
    file.refuse("it holds triangle strips; export it with plain faces");
  }
  const auto& vertices =
      find_element(file, header, "vertex", "it has no vertices; export it again");
  const auto& faces =
      find_element(file, header, "face", "it has no faces, only points; export a mesh with faces");
  for (const char* axis : {"x", "y", "z"}) {
    const auto found = std::ranges::find(vertices.properties, axis, &PlyProperty::name);
    if (found == vertices.properties.end() || found->is_list) {
      file.refuse(fmt::format("its vertices have no {}; export it again", axis));
    }
  }
  if (std::ranges::count_if(faces.properties, is_corner_list) != 1) {
    file.refuse("its faces have no list 'vertex_indices'; export it again");
  }
  if (&faces < &vertices) file.refuse("its faces come before its vertices; export it again");

  CheckedMesh mesh;
  mesh.is_binary = true;
  mesh.vertices = vertices.count;
  mesh.faces = faces.count;
  const bool is_little = std::endian::native == std::endian::little;
  mesh.bytes = fmt::format(
      "ply\nformat binary_{}_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\n"
      "property float z\nelement face {}\nproperty list int int vertex_indices\nend_header\n",
      is_little ? "little" : "big", vertices.count, faces.count);
  PlyBody body(file, header);
  for (const auto& element : header.elements) {
    body.expect_rows(element);
    if (&element == &vertices) {
      copy_vertices(body, element, mesh);
    } else if (&element == &faces) {
      copy_faces(body, element, mesh);
      break;  // what follows the faces is of no use here
    } else {
      skip_rows(body, element);
    }
  }
  return mesh;
}

}  // namespace qjulia
