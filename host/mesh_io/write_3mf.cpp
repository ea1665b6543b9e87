#include "mesh_io/write_3mf.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <span>
#include <vector>

#include "base/markup.hpp"
#include "base/zip_file.hpp"
#include "mesh_io/formats.hpp"
#include "mesh_io/mesh_objects.hpp"
#include "mesh_io/record_stream.hpp"

namespace qjulia::shape {
namespace {

constexpr const char* kContentTypes =
    R"(<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
</Types>
)";
constexpr const char* kRelationships =
    R"(<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Target="/3D/3dmodel.model" Id="model"
 Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>
)";

constexpr std::size_t kColorGroup = 1, kFirstObject = 2;  // ids

/// Numbers in the order of their groups: those of group g are at `first[g]` to `first[g + 1]`.
struct Grouped {
  std::vector<std::uint32_t> numbers;
  std::vector<std::size_t> first;

  std::span<const std::uint32_t> of(std::size_t group) const {
    return std::span(numbers).subspan(first[group], first[group + 1] - first[group]);
  }
};

/// The numbers 0 … `count` − 1 by `group_of(number)`, without those of Objects::kNone.
template <class GroupOf>
Grouped grouped(std::size_t count, std::size_t groups, const GroupOf& group_of) {
  Grouped sorted;
  sorted.first.resize(groups + 1);
  for (std::uint32_t i = 0; i < count; ++i) {
    if (group_of(i) != Objects::kNone) ++sorted.first[group_of(i) + 1];
  }
  std::partial_sum(sorted.first.begin(), sorted.first.end(), sorted.first.begin());
  sorted.numbers.resize(sorted.first.back());
  std::vector<std::size_t> next = sorted.first;
  for (std::uint32_t i = 0; i < count; ++i) {
    if (group_of(i) != Objects::kNone) sorted.numbers[next[group_of(i)]++] = i;
  }
  return sorted;
}

std::uint32_t packed(const VertexColor& color) {
  return std::uint32_t{color[0]} << 16 | std::uint32_t{color[1]} << 8 | color[2];
}

/// All colours that occur, in order.
std::vector<std::uint32_t> distinct(const std::vector<VertexColor>& colors) {
  std::vector<std::uint32_t> all(colors.size());
  std::ranges::transform(colors, all.begin(), packed);
  std::ranges::sort(all);
  all.erase(std::unique(all.begin(), all.end()), all.end());
  all.shrink_to_fit();
  return all;
}

/// The model's XML.
class ModelWriter {
 public:
  ModelWriter(const TriangleMesh& mesh, const Objects& objects, const Eigen::Matrix3d& to_model,
              std::ostream& out)
      : mesh_(mesh),
        objects_(objects),
        to_model_(to_model),
        palette_(distinct(mesh.colors)),
        file_(out) {}

  void write(const std::string& name, const std::string& note) {
    file_.print(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model unit=\"millimeter\" xml:lang=\"en\" "
        "xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\" "
        "xmlns:m=\"http://schemas.microsoft.com/3dmanufacturing/material/2015/02\">\n"
        "<metadata name=\"Title\">{}</metadata>\n"
        "<metadata name=\"Application\">qjulia</metadata>\n",
        base::markup(name));
    if (!note.empty()) {
      file_.print("<metadata name=\"Description\">{}</metadata>\n", base::markup(note));
    }
    file_.print("<resources>\n");
    if (!palette_.empty()) {
      file_.print("<m:colorgroup id=\"{}\">\n", kColorGroup);
      for (const std::uint32_t color : palette_) {
        file_.print("<m:color color=\"#{:06X}\"/>\n", color);
      }
      file_.print("</m:colorgroup>\n");
    }
    write_objects(name);
    file_.print("</resources>\n<build>\n");
    write_items();
    file_.print("</build>\n</model>\n");
  }

 private:
  void write_objects(const std::string& name) {
    const std::size_t count = objects_.count;
    const Grouped triangles = grouped(mesh_.triangles.size(), count,
                                      [&](std::uint32_t t) { return objects_.of_triangle(t); });
    std::vector<std::uint32_t> number(mesh_.vertices.size(), Objects::kNone);  // in its object
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      for (const std::uint32_t v : mesh_.triangles[t]) number[v] = objects_.of_triangle(t);
    }
    const Grouped vertices =
        grouped(number.size(), count, [&](std::uint32_t v) { return number[v]; });
    for (std::size_t object = 0; object < count; ++object) {
      std::uint32_t next = 0;
      for (const std::uint32_t v : vertices.of(object)) number[v] = next++;
      const std::string title =
          count == 1 ? name : fmt::format("{} {} of {}", name, object + 1, count);
      file_.print("<object id=\"{}\" type=\"model\" name=\"{}\"", kFirstObject + object,
                  base::markup(title));
      if (!palette_.empty()) file_.print(" pid=\"{}\" pindex=\"0\"", kColorGroup);
      file_.print("><mesh><vertices>\n");
      for (const std::uint32_t v : vertices.of(object)) write_vertex(v);
      file_.print("</vertices><triangles>\n");
      for (const std::uint32_t t : triangles.of(object)) write_triangle(mesh_.triangles[t], number);
      file_.print("</triangles></mesh></object>\n");
    }
  }

  void write_vertex(std::uint32_t v) {
    const Eigen::Vector3f x = (to_model_ * mesh_.vertices[v]).cast<float>();
    low_ = low_.cwiseMin(x);
    file_.print("<vertex x=\"{}\" y=\"{}\" z=\"{}\"/>\n", x.x(), x.y(), x.z());
  }

  void write_triangle(const Triangle& corners, const std::vector<std::uint32_t>& number) {
    const auto& [a, b, c] = corners;
    file_.print("<triangle v1=\"{}\" v2=\"{}\" v3=\"{}\"", number[a], number[b], number[c]);
    if (!palette_.empty()) {
      file_.print(" p1=\"{}\" p2=\"{}\" p3=\"{}\"", color_of(a), color_of(b), color_of(c));
    }
    file_.print("/>\n");
  }

  std::size_t color_of(std::uint32_t vertex) const {
    return static_cast<std::size_t>(
        std::ranges::lower_bound(palette_, packed(mesh_.colors[vertex])) - palette_.begin());
  }

  /// All objects moved alike, so that they keep their places and stand on the plate.
  void write_items() {
    for (std::size_t object = 0; object < objects_.count; ++object) {
      file_.print("<item objectid=\"{}\" transform=\"1 0 0 0 1 0 0 0 1 {} {} {}\"/>\n",
                  kFirstObject + object, -low_.x(), -low_.y(), -low_.z());
    }
  }

  const TriangleMesh& mesh_;
  const Objects& objects_;
  Eigen::Matrix3d to_model_;
  std::vector<std::uint32_t> palette_;
  Eigen::Vector3f low_ = Eigen::Vector3f::Constant(std::numeric_limits<float>::infinity());
  RecordStream file_;
};

/// The model is not longer, in bytes.
std::uint64_t most_bytes(const TriangleMesh& mesh, std::size_t objects, const std::string& name,
                         const std::string& note) {
  constexpr std::uint64_t kOfVertex = 80, kOfTriangle = 110, kOfColor = 30, kOfObject = 512,
                          kRest = 4096;
  constexpr std::uint64_t kEscaped = 6;  // bytes of "&quot;"
  return kRest + kEscaped * (name.size() + note.size()) + kOfVertex * mesh.vertices.size() +
         kOfColor * mesh.colors.size() + kOfTriangle * mesh.triangles.size() +
         (kOfObject + kEscaped * name.size()) * objects;
}

}  // namespace

void write_3mf(const TriangleMesh& mesh, const std::string& name, const std::string& note,
               const Eigen::Matrix3d& turn, double scale, std::ostream& out) {
  const Objects objects = objects_of(mesh);
  base::ZipFile zip(out);
  zip.begin("[Content_Types].xml", 0) << kContentTypes;
  zip.begin("_rels/.rels", 0) << kRelationships;
  std::ostream& model = zip.begin("3D/3dmodel.model", most_bytes(mesh, objects.count, name, note));
  ModelWriter(mesh, objects, scale * turn, model).write(name, note);
  zip.finish();
}

MeshFormat threemf_format() {
  return {.seems = "a ZIP archive; if it holds a mesh, unpack it first",
          .looks_like = [](std::string_view head) { return head.starts_with("PK\3\4"); },
          .may_be_another = true,
          .read = read_3mf,
          .write =
              [](const TriangleMesh& mesh, const MeshWriting& how, std::ostream& out) {
                constexpr double kMillimetres = 1000;  // in a metre
                const auto& metres = how.options.metres_per_unit;
                write_3mf(mesh, how.name, how.options.note, quarter_turns(how.up(), UpAxis::z),
                          metres ? kMillimetres * *metres : 1, out);
              },
          .up = UpAxis::z,
          .has_colors = true};
}

}  // namespace qjulia::shape
