#include "mesh_io/write_obj.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/srgb.hpp"
#include "mesh_io/record_stream.hpp"

namespace qjulia::shape {
namespace {

constexpr const char* kMaterialName = "mean_colour";

/// A line of text: a name that the file holds as it is must not end its line.
std::string one_obj_line(std::string text) {
  std::ranges::replace_if(
      text, [](unsigned char c) { return c < ' '; }, '_');
  return text;
}

}  // namespace

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

}  // namespace qjulia::shape
