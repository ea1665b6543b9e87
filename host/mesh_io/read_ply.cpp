/// Polygon files (.ply, Turk 1994), in text and binary of either byte order.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <map>

#include "mesh_io/mesh_file.hpp"

namespace qjulia::shape {
namespace {

enum class Format { text, little_endian, big_endian };

/// A type of number, as a binary file stores it.
struct Type {
  std::size_t size;                              ///< bytes
  double (*read)(const char* bytes, bool swap);  ///< swap: in the other byte order than ours
  bool operator==(const Type&) const = default;
};

template <class Number>
constexpr Type kType{sizeof(Number), [](const char* bytes, bool swap) {
                       std::array<char, sizeof(Number)> ours;
                       std::copy_n(bytes, ours.size(), ours.begin());
                       if (swap) std::ranges::reverse(ours);
                       return static_cast<double>(std::bit_cast<Number>(ours));
                     }};

struct Property {
  std::string name;
  Type type = kType<float>;  ///< the value's, or that of a list's values
  bool is_list = false;
  Type count_type = kType<std::uint8_t>;  ///< a list's length has this type
};

struct Element {
  std::string name;
  std::size_t count = 0;  ///< promised, not checked
  std::vector<Property> properties;
};

struct Header {
  std::optional<Format> format;
  std::vector<Element> elements;
  std::string_view body;  ///< what follows the header
};

Type type_named(const MeshFile& file, std::string_view name) {
  static const std::map<std::string_view, Type> types = {
      {"char", kType<std::int8_t>},     {"int8", kType<std::int8_t>},
      {"uchar", kType<std::uint8_t>},   {"uint8", kType<std::uint8_t>},
      {"short", kType<std::int16_t>},   {"int16", kType<std::int16_t>},
      {"ushort", kType<std::uint16_t>}, {"uint16", kType<std::uint16_t>},
      {"int", kType<std::int32_t>},     {"int32", kType<std::int32_t>},
      {"uint", kType<std::uint32_t>},   {"uint32", kType<std::uint32_t>},
      {"float", kType<float>},          {"float32", kType<float>},
      {"double", kType<double>},        {"float64", kType<double>}};
  const auto found = types.find(name);
  if (found == types.end()) {
    file.refuse(fmt::format("its PLY header has an unknown type '{}'; export it again", name));
  }
  return found->second;
}

Format format_named(const MeshFile& file, std::string_view name) {
  if (name == "ascii") return Format::text;
  if (name == "binary_little_endian") return Format::little_endian;
  if (name == "binary_big_endian") return Format::big_endian;
  file.refuse("its PLY header names no known format; export it again");
}

Property property_of(const MeshFile& file, std::string_view rest) {
  Property property;
  std::string_view type = take_word(rest);
  property.is_list = type == "list";
  if (property.is_list) {
    property.count_type = type_named(file, take_word(rest));
    type = take_word(rest);
  }
  property.type = type_named(file, type);
  property.name = take_word(rest);
  return property;
}

Header read_header(const MeshFile& file) {
  Lines lines(file.text(), '\0');
  if (lines.next() != "ply") file.refuse_type("it does not begin with 'ply'; is it a .ply file?");
  Header header;
  while (const auto line = lines.next()) {
    std::string_view rest = *line;
    const std::string_view key = take_word(rest);
    if (key == "format") {
      header.format = format_named(file, take_word(rest));
    } else if (key == "element") {
      Element element;
      element.name = take_word(rest);
      const auto count = to_integer(take_word(rest));
      if (!count || *count < 0) {
        file.refuse_line(lines.number(), "an element needs a count; export it again");
      }
      element.count = static_cast<std::size_t>(*count);
      header.elements.push_back(std::move(element));
    } else if (key == "property" && !header.elements.empty()) {
      header.elements.back().properties.push_back(property_of(file, rest));
    } else if (key == "end_header") {
      if (!header.format) break;
      header.body = lines.rest();
      return header;
    } else if (key != "comment" && key != "obj_info") {
      file.refuse_line(lines.number(), "it does not belong in a PLY header; export it again");
    }
  }
  file.refuse("its PLY header has no format or no end; the file may be cut off, export it again");
}

/// The values of the body, one after the other, as text or as bytes.
class Body {
 public:
  Body(const MeshFile& file, const Header& header)
      : file_(file),
        is_text_(header.format == Format::text),
        swap_((header.format == Format::little_endian) !=
              (std::endian::native == std::endian::little)),
        rest_(header.body) {}

  /// Refuses the file when the element's rows cannot be in what is left.
  void expect_rows(const Element& element) const {
    std::size_t row = 0;  // least bytes of one: a digit and a blank a value, where lists are empty
    for (const auto& property : element.properties) {
      row += is_text_ ? 2 : (property.is_list ? property.count_type : property.type).size;
    }
    if (row > 0 && element.count > (rest_.size() + 1) / row) {
      file_.refuse(
          fmt::format("its header promises {} of '{}' but only {} bytes follow; it may be cut "
                      "off, export it again",
                      element.count, element.name, rest_.size()));
    }
  }

  double next(Type type) {
    if (is_text_) {
      const std::string_view word = take_word(rest_);
      if (word.empty()) refuse_end();
      // What is no number, such as "nan" for an unknown normal, is refused only where it matters.
      return to_number(word).value_or(std::numeric_limits<double>::quiet_NaN());
    }
    if (rest_.size() < type.size) refuse_end();
    const double value = type.read(rest_.data(), swap_);
    rest_.remove_prefix(type.size);
    return value;
  }

  float next_coordinate(Type type) {
    const double value = next(type);
    if (!(std::abs(value) <= std::numeric_limits<float>::max())) {
      file_.refuse("a vertex has a coordinate that is not a finite number; export it again");
    }
    return static_cast<float>(value);
  }

  std::int64_t next_integer(Type type, std::int64_t least, std::int64_t most, const char* what) {
    const double value = next(type);
    if (!(value >= static_cast<double>(least) && value <= static_cast<double>(most)) ||
        value != std::floor(value)) {
      file_.refuse(
          fmt::format("{} is {}, not one of {} to {}; export it again", what, value, least, most));
    }
    return static_cast<std::int64_t>(value);
  }

  std::int64_t next_length(const Property& list, std::int64_t least) {
    return next_integer(list.count_type, least, INT32_MAX, "a list's length");
  }

  /// Passes over a value or a list.
  void skip(const Property& property) {
    for (auto count = property.is_list ? next_length(property, 0) : 1; count > 0; --count) {
      if (++skipped_ % kPolled == 0) file_.poll();
      next(property.type);
    }
  }

 private:
  [[noreturn]] void refuse_end() const {
    file_.refuse("the file ends too early; it may be cut off, export it again");
  }

  const MeshFile& file_;
  bool is_text_;
  bool swap_;
  std::string_view rest_;
  std::size_t skipped_ = 0;
};

bool is_color(const Property& property) {
  return property.name == "red" || property.name == "green" || property.name == "blue";
}

/// The vertices' shares of the detail: one property or, if none is named, the mean of three colors.
class Shares {
 public:
  Shares(const MeshFile& file, const Element& vertices, const std::string& name)
      : file_(file), name_(name) {
    for (const Property& property : vertices.properties) {
      const bool is_wanted = name.empty() ? is_color(property) : property.name == name;
      is_used_.push_back(is_wanted && !property.is_list);
    }
    if (std::ranges::count(is_used_, true) == std::ptrdiff_t{parts()}) return;
    file.refuse(name.empty() ? "its vertices have no red, green and blue; export it with vertex "
                               "colors, or name a property"
                             : fmt::format("its vertices have no property '{}'", name));
  }

  /// Whether the vertices' property number `place` makes shares.
  bool uses(std::size_t place) const { return is_used_[place]; }

  /// What the value of such a property adds to a vertex's share.
  double part(std::size_t vertex, const Property& property, double value) {
    // A text file may give a byte a value that bytes cannot have. Computed numbers may be off by a
    // rounding error.
    constexpr double kRounding = 1e-6;
    const bool is_byte = property.type == kType<std::uint8_t>;
    const bool is_share = is_byte ? value >= 0 && value <= kMostByte && value == std::floor(value)
                                  : value >= -kRounding && value <= 1 + kRounding;
    if (!is_share) refuse_or_note(vertex, property, value);
    least_ = std::min(least_, value);
    most_ = std::max(most_, value);
    return value / ((is_byte ? kMostByte : 1) * parts());
  }

  /// Call this after the last vertex. @throws InputError if a value was out of range.
  void check_range() const {
    if (!first_wrong_) return;
    const bool is_axis = name_ == "x" || name_ == "y" || name_ == "z";
    file_.refuse(fmt::format(
        "its property '{}' goes from {} to {}, and a share is a number from 0 to 1, or a "
        "byte from 0 to 255 (vertex {} is the first out of range): scale it and export "
        "the mesh again{}",
        name_, least_, most_, *first_wrong_,
        is_axis ? "; for shares along an axis use a ramp, which needs no mesh" : ""));
  }

 private:
  static constexpr double kMostByte = 255;

  int parts() const { return name_.empty() ? 3 : 1; }

  /// A value of a named property is only noted, because the refusal gives the property's whole
  /// range.
  void refuse_or_note(std::size_t vertex, const Property& property, double value) {
    if (std::isnan(value)) {
      file_.refuse(fmt::format("vertex {} has no number for its '{}'; export it again", vertex,
                               property.name));
    }
    if (name_.empty()) {
      file_.refuse(fmt::format(
          "vertex {} has a {} of {}; give colors as whole numbers from 0 to 255 in a property of "
          "type uchar, or as numbers from 0 to 1 in one of type float",
          vertex, property.name, value));
    }
    if (!first_wrong_) first_wrong_ = vertex;
  }

  const MeshFile& file_;
  const std::string& name_;
  std::vector<bool> is_used_;
  std::optional<std::size_t> first_wrong_;
  double least_ = std::numeric_limits<double>::infinity();
  double most_ = -std::numeric_limits<double>::infinity();
};

/// 0, 1 or 2 for "nx", "ny" and "nz".
std::optional<Eigen::Index> normal_axis(const Property& property) {
  const std::string& name = property.name;
  if (property.is_list || name.size() != 2 || name[0] != 'n') return std::nullopt;
  if (name[1] < 'x' || name[1] > 'z') return std::nullopt;
  return name[1] - 'x';
}

/// @param shares null if they are not asked for. @param has_faces points need normals, and vertices
/// of faces do not.
void read_vertices(Body& body, const Element& element, Shares* shares, bool has_faces,
                   FaceList& mesh) {
  for (std::size_t i = 0; i < element.count; ++i) {
    Eigen::Vector3f x = Eigen::Vector3f::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    double share = 0;
    for (std::size_t p = 0; p < element.properties.size(); ++p) {
      const Property& property = element.properties[p];
      const bool makes_share = shares != nullptr && shares->uses(p);
      const char axis = property.name.size() == 1 ? property.name[0] : '\0';
      double value = 0;
      if (axis >= 'x' && axis <= 'z' && !property.is_list) {
        const float coordinate = body.next_coordinate(property.type);
        x[axis - 'x'] = coordinate;
        value = double{coordinate};
      } else if (makes_share) {
        value = body.next(property.type);
      } else if (const auto along = normal_axis(property); along && !has_faces) {
        normal[*along] = body.next(property.type);
      } else {
        body.skip(property);
      }
      if (makes_share) share += shares->part(i, property, value);
    }
    mesh.add_vertex(x);
    if (!has_faces) mesh.normals.push_back(normal);
    if (shares != nullptr) {
      mesh.shares.push_back(static_cast<float>(std::clamp(share, 0.0, 1.0)));
    }
  }
  if (shares != nullptr) shares->check_range();
}

bool is_corner_list(const Property& property) {
  return property.is_list && (property.name == "vertex_indices" || property.name == "vertex_index");
}

void read_faces(Body& body, const Element& element, FaceList& mesh) {
  const auto last = static_cast<std::int64_t>(mesh.vertices.size()) - 1;
  std::vector<std::uint32_t> corners;
  for (std::size_t i = 0; i < element.count; ++i) {
    for (const auto& property : element.properties) {
      if (!is_corner_list(property)) {
        body.skip(property);
        continue;
      }
      corners.clear();
      for (auto count = body.next_length(property, 3); count > 0; --count) {
        corners.push_back(static_cast<std::uint32_t>(
            body.next_integer(property.type, 0, last, "a face's vertex")));
      }
      mesh.add_face(corners);
    }
  }
}

/// The element of that name that has rows; null where there is none.
const Element* find_element(const Header& header, const char* name) {
  const auto found = std::ranges::find(header.elements, name, &Element::name);
  return found == header.elements.end() || found->count == 0 ? nullptr : &*found;
}

/// What the file must have before its body is read.
/// @param faces null for points. @param is_painted is it read for its colors?
void check_elements(const MeshFile& file, const Header& header, const Element* vertices,
                    const Element* faces, bool is_painted) {
  if (std::ranges::count(header.elements, "tristrips", &Element::name) > 0) {
    file.refuse("it holds triangle strips; export it with plain faces");
  }
  if (vertices == nullptr) file.refuse("it has no vertices; export it again");
  for (const char* axis : {"x", "y", "z"}) {
    const auto found = std::ranges::find(vertices->properties, axis, &Property::name);
    if (found == vertices->properties.end() || found->is_list) {
      file.refuse(fmt::format("its vertices have no {}; export it again", axis));
    }
  }
  if (faces == nullptr) {
    if (is_painted) {
      file.refuse(
          "it has no faces, only points, and paint needs a surface; export a mesh with "
          "faces");
    }
    if (std::ranges::count_if(vertices->properties,
                              [](const auto& p) { return normal_axis(p).has_value(); }) != 3) {
      file.refuse(
          "it has no faces, only points, and these have no normals (nx, ny, nz), which show "
          "the inside; compute them, as MeshLab and CloudCompare do, and save them with the "
          "points, or "
          "export a mesh with faces");
    }
    return;
  }
  if (std::ranges::count_if(faces->properties, is_corner_list) != 1) {
    file.refuse("its faces have no list 'vertex_indices'; export it again");
  }
  if (faces < vertices) file.refuse("its faces come before its vertices; export it again");
}

}  // namespace

FaceList read_ply(const MeshFile& file, const std::string* share) {
  const Header header = read_header(file);
  const Element* vertices = find_element(header, "vertex");
  const Element* faces = find_element(header, "face");
  check_elements(file, header, vertices, faces, share != nullptr);

  FaceList mesh(file);
  Body body(file, header);
  std::optional<Shares> shares;
  if (share != nullptr) shares.emplace(file, *vertices, *share);
  for (const auto& element : header.elements) {
    body.expect_rows(element);
    if (&element == vertices) {
      read_vertices(body, element, shares ? &*shares : nullptr, faces != nullptr, mesh);
      if (faces == nullptr) break;
    } else if (&element == faces) {
      read_faces(body, element, mesh);
      break;  // what follows the faces is of no use here
    } else {
      for (std::size_t i = 0; i < element.count && !element.properties.empty(); ++i) {
        for (const auto& property : element.properties) body.skip(property);
      }
    }
  }
  return mesh;
}

}  // namespace qjulia::shape
