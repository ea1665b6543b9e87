#include "mesh_io/obj_format.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/srgb.hpp"
#include "mesh_io/formats.hpp"
#include "mesh_io/record_stream.hpp"

namespace qjulia::shape {
namespace {

constexpr const char* kMaterialName = "mean_colour";

/// Reads `v` and `f` lines; all others are passed over.
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

FaceList read_obj(const MeshFile& file, const std::string* share) {
  if (share != nullptr && !share->empty()) {
    file.refuse(fmt::format("an .obj has no property '{}', only colors; give a .ply", *share));
  }
  return ObjReader(file, share != nullptr).read();
}

/// A line of text: a name that the file holds as it is must not end its line.
std::string one_obj_line(std::string text) {
  std::ranges::replace_if(
      text, [](unsigned char c) { return c < ' '; }, '_');
  return text;
}

/// Wavefront .obj: corners are numbered from 1; a normal has the number of its vertex. A colour
/// follows its vertex's coordinates, sRGB from 0 to 1.
/// @param name of the object. @param turn the mesh is turned by it.
/// @param material the file name of its material; empty: none.
void write_obj(const TriangleMesh& mesh, const std::string& name, const std::string& note,
               const Eigen::Matrix3d& turn, const std::string& material, std::ostream& out) {
  RecordStream file(out);
  if (!note.empty()) file.print("# {}\n", note);
  file.print("# {} vertices, {} faces\n", mesh.vertices.size(), mesh.triangles.size());
  if (!material.empty()) file.print("mtllib {}\n", material);
  file.print("o {}\n", one_obj_line(name));
  const Eigen::Matrix3f turn_normal = turn.cast<float>();
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const Eigen::Vector3f x = (turn * mesh.vertices[v]).cast<float>();
    // Nine digits are enough to read the same float back.
    file.print("v {:.9g} {:.9g} {:.9g}", x.x(), x.y(), x.z());
    if (!mesh.colors.empty()) {
      for (const std::uint8_t c : mesh.colors[v]) file.print(" {:.4f}", c / 255.0);
    }
    file.print("\n");
    if (mesh.normals.empty()) continue;
    const Eigen::Vector3f n = turn_normal * mesh.normals[v];
    file.print("vn {:.9g} {:.9g} {:.9g}\n", n.x(), n.y(), n.z());
  }
  if (!material.empty()) file.print("usemtl {}\n", kMaterialName);
  if (!mesh.normals.empty()) file.print("s 1\n");
  for (const auto& [a, b, c] : mesh.triangles) {
    if (mesh.normals.empty()) {
      file.print("f {} {} {}\n", a + 1, b + 1, c + 1);
    } else {
      file.print("f {0}//{0} {1}//{1} {2}//{2}\n", a + 1, b + 1, c + 1);
    }
  }
}

/// The format has no mark at its beginning: it is recognised by its first word that is no comment.
bool looks_like_obj(std::string_view head) {
  Lines lines(head);
  const auto line = lines.next();
  if (!line) return false;
  std::string_view rest = *line;
  const std::string_view key = take_word(rest);
  if (key == "v" || key == "vn" || key == "vt") return take_point(rest).has_value() || key != "v";
  return key == "mtllib";
}

}  // namespace

std::string obj_material(const TriangleMesh& mesh) {
  // Colours are averaged as linear light, not as their sRGB codes.
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const VertexColor& color : mesh.colors) {
    for (int i = 0; i < 3; ++i) {
      mean[i] += base::srgb_decoded(color[static_cast<std::size_t>(i)] / 255.0);
    }
  }
  mean /= static_cast<double>(mesh.colors.size());
  return fmt::format("newmtl {}\nKd {:.4f} {:.4f} {:.4f}\nKs 0 0 0\nillum 1\n", kMaterialName,
                     base::srgb_encoded(mean.x()), base::srgb_encoded(mean.y()),
                     base::srgb_encoded(mean.z()));
}

MeshFormat obj_format() {
  return {.seems = "a Wavefront .obj file",
          .looks_like = looks_like_obj,
          .read = read_obj,
          .write =
              [](const TriangleMesh& mesh, const MeshWriting& how, std::ostream& out) {
                write_obj(mesh, how.name, how.options.note, how.options.file_turn(), how.material,
                          out);
              },
          .has_colors = true};
}

}  // namespace qjulia::shape
