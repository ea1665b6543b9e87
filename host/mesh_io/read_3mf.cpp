/// 3D Manufacturing Format (.3mf): https://github.com/3MFConsortium/spec_core, with the paths of
/// the production extension. A ZIP archive of XML; Expat reads it while it is unpacked.

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "base/text.hpp"
#include "mesh_io/mesh_file.hpp"
#include "mesh_io/scene_faces.hpp"
#include "mesh_io/xml_reader.hpp"
#include "mesh_io/zip_archive.hpp"

namespace qjulia::shape {
namespace {

/// An object's part of the archive and its number there.
struct ObjectKey {
  std::string part, id;
  auto operator<=>(const ObjectKey&) const = default;
};

/// An object, placed as a component of another one or as an item to build.
struct PlacedObject {
  ObjectKey key;
  Eigen::Affine3d to_parent;
};

struct ModelObject {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Triangle> triangles;
  std::vector<PlacedObject> components;
  bool is_support = false;
};

/// The name of a part without the slash that it begins with.
std::string part_name(std::string_view path) {
  if (path.starts_with('/')) path.remove_prefix(1);
  return std::string(path);
}

class ThreeMfReader {
 public:
  explicit ThreeMfReader(const MeshFile& file) : file_(file), archive_(file) {}

  FaceList read() {
    root_ = root_part();
    waiting_.push_back(root_);
    while (!waiting_.empty()) {
      const std::string part = std::move(waiting_.back());
      waiting_.pop_back();
      if (seen_.insert(part).second) read_model(part);
    }
    SceneFaces faces(file_, file_.bytes().size() + parsed_items());
    Eigen::Affine3d to_millimetres = Eigen::Affine3d::Identity();
    to_millimetres.scale(millimetres_);
    for (const PlacedObject& item : items_) {
      place(item.key, to_millimetres * item.to_parent, 0, faces);
    }
    return std::move(faces).take();
  }

 private:
  /// Vertices and triangles of all objects. What is unpacked besides, such as blanks, must not let
  /// a scene grow.
  std::size_t parsed_items() const {
    std::size_t items = 0;
    for (const auto& [key, object] : objects_) {
      items += object.vertices.size() + object.triangles.size();
    }
    return items;
  }

  void unpack(const std::string& part, const XmlReader::Start& start, const XmlReader::End& end) {
    const ZipArchive::Entry* entry = archive_.find(part);
    if (entry == nullptr) {
      file_.refuse(fmt::format("'{}' is missing in it (is it a .3mf file?); export it again",
                               base::to_utf8(part)));
    }
    XmlReader xml(file_, part, start, end);
    archive_.unpack(*entry, [&](std::string_view bytes) { xml.add(bytes); });
    xml.finish();
  }

  /// The part that the archive begins with.
  std::string root_part() {
    std::string part;
    unpack(
        "_rels/.rels",
        [&](std::string_view name, const XmlAttributes& attributes) {
          const auto type = attributes.find("Type");
          const auto target = attributes.find("Target");
          if (name.ends_with("|Relationship") && type && target && type->ends_with("/3dmodel")) {
            part = part_name(*target);
          }
        },
        [](std::string_view) {});
    if (part.empty()) file_.refuse("it names no 3D model; is it a .3mf file?");
    return part;
  }

  void read_model(const std::string& part) {
    part_ = part;
    object_ = nullptr;
    unpack(
        part,
        [this](std::string_view name, const XmlAttributes& attributes) {
          start_element(name, attributes);
        },
        [this](std::string_view name) {
          if (core_name(name) == "object") object_ = nullptr;
        });
  }

  /// The name of an element of the format itself; empty for those of extensions.
  static std::string_view core_name(std::string_view name) {
    constexpr std::string_view kCore = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02|";
    return name.starts_with(kCore) ? name.substr(kCore.size()) : std::string_view();
  }

  void start_element(std::string_view full_name, const XmlAttributes& attributes) {
    const std::string_view name = core_name(full_name);
    if (name == "vertex" && object_ != nullptr) {
      object_->vertices.emplace_back(number(attributes, "x"), number(attributes, "y"),
                                     number(attributes, "z"));
    } else if (name == "triangle" && object_ != nullptr) {
      object_->triangles.push_back(
          {index(attributes, "v1"), index(attributes, "v2"), index(attributes, "v3")});
    } else if (name == "component" && object_ != nullptr) {
      object_->components.push_back(placed(attributes));
    } else if (name == "item") {
      if (part_ == root_) items_.push_back(placed(attributes));
    } else if (name == "object") {
      const auto [object, is_new] = objects_.try_emplace({part_, text(attributes, "id")});
      if (!is_new) {
        file_.refuse(
            fmt::format("two objects in it have the number {}; export it again", object->first.id));
      }
      object_ = &object->second;
      object_->is_support = attributes.find("type").value_or("").ends_with("support");
    } else if (name == "model" && part_ == root_) {
      millimetres_ = unit(attributes.find("unit").value_or("millimeter"));
    }
  }

  double unit(std::string_view name) const {
    constexpr std::pair<std::string_view, double> kUnits[] = {{"micron", 0.001},  {"millimeter", 1},
                                                              {"centimeter", 10}, {"inch", 25.4},
                                                              {"foot", 304.8},    {"meter", 1000}};
    for (const auto& [unit, millimetres] : kUnits) {
      if (unit == name) return millimetres;
    }
    file_.refuse(fmt::format("its unit is '{}', which 3MF does not have; export it again",
                             base::to_utf8(name)));
  }

  std::string text(const XmlAttributes& attributes, const char* key) const {
    const auto value = attributes.find(key);
    if (!value) file_.refuse(fmt::format("an element has no '{}'; export it again", key));
    return std::string(*value);
  }

  double number(const XmlAttributes& attributes, const char* key) const {
    std::string_view rest = attributes.find(key).value_or("");
    const auto value = to_number(take_word(rest));
    if (!value) {
      file_.refuse(
          fmt::format("vertex {} of an object has no finite number for '{}'; export it "
                      "again",
                      object_->vertices.size(), key));
    }
    return *value;
  }

  std::uint32_t index(const XmlAttributes& attributes, const char* key) const {
    std::string_view rest = attributes.find(key).value_or("");
    const auto value = to_integer(take_word(rest));
    if (!value || *value < 0 || *value > std::numeric_limits<std::int32_t>::max()) {
      file_.refuse(fmt::format("triangle {} of an object has no vertex '{}'; export it again",
                               object_->triangles.size(), key));
    }
    return static_cast<std::uint32_t>(*value);
  }

  /// An object that is named by its number, in this part or in another one.
  PlacedObject placed(const XmlAttributes& attributes) {
    constexpr std::size_t kMostPlacements = std::size_t{1} << 20;
    if (++placements_ > kMostPlacements) {
      file_.refuse(fmt::format("it has more than {} items and components; export it as one mesh",
                               kMostPlacements));
    }
    PlacedObject placed{{part_, text(attributes, "objectid")}, Eigen::Affine3d::Identity()};
    if (const auto path = attributes.find("path")) {
      placed.key.part = part_name(*path);
      waiting_.push_back(placed.key.part);
    }
    const auto transform = attributes.find("transform");
    if (!transform) return placed;
    // Rows of four by three: coordinates are a row to their left.
    Eigen::Matrix<double, 4, 3, Eigen::RowMajor> rows;
    std::string_view rest = *transform;
    for (double& entry : rows.reshaped<Eigen::RowMajor>()) {
      const auto value = to_number(take_word(rest));
      if (!value) file_.refuse("a transform in it is not 12 finite numbers; export it again");
      entry = *value;
    }
    placed.to_parent.affine() = rows.transpose();
    return placed;
  }

  void place(const ObjectKey& key, const Eigen::Affine3d& to_scene, int depth, SceneFaces& faces) {
    constexpr int kMostDepth = 64;
    if (depth > kMostDepth) {
      file_.refuse("its components are nested too deeply, or hold themselves; export it again");
    }
    const auto found = objects_.find(key);
    if (found == objects_.end()) {
      file_.refuse(fmt::format("it builds object {}, which is missing; export it again",
                               base::to_utf8(key.id)));
    }
    const ModelObject& object = found->second;
    if (object.is_support) return;
    constexpr std::size_t kPlacement = 16;  // what one costs that adds no triangles
    faces.spend(kPlacement);
    faces.add(
        object.triangles, object.vertices.size(),
        [&](std::uint32_t v) { return object.vertices[v]; }, to_scene);
    for (const PlacedObject& component : object.components) {
      place(component.key, to_scene * component.to_parent, depth + 1, faces);
    }
  }

  const MeshFile& file_;
  ZipArchive archive_;
  std::string root_;                  ///< the part that says what is built
  std::vector<std::string> waiting_;  ///< parts to read
  std::set<std::string> seen_;        ///< parts that were read
  std::map<ObjectKey, ModelObject> objects_;
  std::vector<PlacedObject> items_;
  std::size_t placements_ = 0;     ///< items and components
  double millimetres_ = 1;         ///< of the model's unit
  std::string part_;               ///< the one that is being read
  ModelObject* object_ = nullptr;  ///< the one whose elements are being read
};

}  // namespace

FaceList read_3mf(const MeshFile& file, const std::string* /*share*/) {
  return ThreeMfReader(file).read();
}

}  // namespace qjulia::shape
