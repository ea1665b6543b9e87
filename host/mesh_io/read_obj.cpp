/// Wavefront .obj: `v` and `f` lines; all others are passed over.

#include <fmt/format.h>

#include "mesh_io/mesh_file.hpp"

namespace qjulia::shape {
namespace {

class ObjReader {
 public:
  ObjReader(const MeshFile& file, bool with_colors)
      : file_(file), lines_(file.text()), faces_(file), with_colors_(with_colors) {}

  FaceList read() {
    while (const auto line = lines_.next()) {
      std::string_view rest = *line;
      const std::string_view key = take_word(rest);
      if (key == "v") {
        add_vertex(continued(rest));
      } else if (key == "f") {
        add_face(continued(rest));
      }
    }
    if (faces_.vertices.empty()) {
      file_.refuse_type("it has no vertices; is it a Wavefront .obj file?");
    }
    if (faces_.faces() == 0) file_.refuse("it has no faces; export a mesh with faces");
    if (greatest_ >= static_cast<long long>(faces_.vertices.size())) {
      file_.refuse_line(
          greatest_line_,
          fmt::format("a face names vertex {}, but there are {}; export the mesh again",
                      greatest_ + 1, faces_.vertices.size()));
    }
    return std::move(faces_);
  }

 private:
  /// The line, with those that follow it while each ends in a backslash.
  std::string_view continued(std::string_view line) {
    if (!line.ends_with('\\')) return line;
    joined_ = line;
    while (joined_.ends_with('\\')) {
      joined_.back() = ' ';
      joined_ += lines_.next().value_or("");
    }
    return joined_;
  }

  [[noreturn]] void refuse(std::string_view what) const {
    file_.refuse_line(lines_.number(), what);
  }

  void add_vertex(std::string_view rest) {
    const auto point = take_point(rest);
    if (!point) refuse("a vertex needs three finite numbers; export it again");
    faces_.add_vertex(*point);
    if (with_colors_) add_color(rest);
  }

  /// "v x y z r g b", each color 0 … 1.
  void add_color(std::string_view rest) {
    const auto color = take_point(rest);
    if (!color) {
      refuse(
          "the vertex has no color: three numbers after its coordinates. Export the "
          "mesh with vertex colors");
    }
    if (color->minCoeff() < 0 || color->maxCoeff() > 1) {
      refuse(
          fmt::format("the vertex has the color {} {} {}, and colors are 0 to 1; export it again",
                      color->x(), color->y(), color->z()));
    }
    faces_.shares.push_back(color->mean());
  }

  /// "3", "3/1", "3//2" and "3/1/2" name vertex 3; negative numbers count back from the last vertex
  /// so far.
  void add_face(std::string_view rest) {
    corners_.clear();
    for (auto word = take_word(rest); !word.empty(); word = take_word(rest)) {
      const auto number = to_integer(word.substr(0, word.find('/')));
      if (!number || *number == 0) {
        refuse(
            fmt::format("'{}' is not a vertex number; .obj counts vertices from 1. "
                        "Export the mesh again",
                        word));
      }
      const long long index =
          *number > 0 ? *number - 1 : static_cast<long long>(faces_.vertices.size()) + *number;
      if (index < 0) {
        refuse("a vertex number counts back past the first vertex");
      }
      if (index > greatest_) {
        greatest_ = index;
        greatest_line_ = lines_.number();
      }
      corners_.push_back(static_cast<std::uint32_t>(index));  // checked at the end
    }
    if (corners_.size() < 3) {
      refuse("a face needs three vertices; the file may be cut off, export it again");
    }
    faces_.add_face(corners_);
  }

  const MeshFile& file_;
  Lines lines_;
  FaceList faces_;
  bool with_colors_;
  std::string joined_;
  std::vector<std::uint32_t> corners_;
  long long greatest_ = -1;  ///< vertex that a face names
  std::size_t greatest_line_ = 0;
};

}  // namespace

FaceList read_obj(const MeshFile& file, const std::string* share) {
  if (share != nullptr && !share->empty()) {
    file.refuse(fmt::format("an .obj has no property '{}', only colors; give a .ply", *share));
  }
  return ObjReader(file, share != nullptr).read();
}

}  // namespace qjulia::shape
