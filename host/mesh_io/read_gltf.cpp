/// Scenes of glTF 2.0 (.gltf and .glb): https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html
///
/// Debian's reader, tinygltf, is not used: it opens whatever files a scene names, decodes pictures,
/// and checks data that it was not told to trust with `assert`.

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <string>

#include "base/base64.hpp"
#include "base/text.hpp"
#include "mesh_io/formats.hpp"
#include "mesh_io/mesh_file.hpp"
#include "mesh_io/scene_faces.hpp"

namespace qjulia::shape {
namespace {

using nlohmann::json;

/// A number of an accessor, as bytes.
struct ComponentType {
  int code;  ///< the format's
  std::size_t size;
  double (*read)(const char* bytes);
  double most;  ///< what is 1 where numbers are shares of it
  bool is_real;
};

template <class Number>
constexpr ComponentType component_type(int code) {
  return {code, sizeof(Number),
          [](const char* bytes) {
            Number number;
            std::memcpy(&number, bytes, sizeof number);
            return static_cast<double>(number);
          },
          static_cast<double>(std::numeric_limits<Number>::max()),
          !std::numeric_limits<Number>::is_integer};
}

constexpr std::array kComponentTypes = {
    component_type<std::int8_t>(5120),   component_type<std::uint8_t>(5121),
    component_type<std::int16_t>(5122),  component_type<std::uint16_t>(5123),
    component_type<std::uint32_t>(5125), component_type<float>(5126)};

/// Numbers in a buffer, within its bounds.
struct Accessor {
  std::string_view bytes;  ///< from the first element to the last
  std::size_t count = 0;   ///< of elements
  std::size_t step = 0;    ///< from an element to the next, bytes
  ComponentType type = kComponentTypes.back();
  bool is_share = false;

  double at(std::size_t element, std::size_t component) const {
    const double value = type.read(bytes.data() + element * step + component * type.size);
    return is_share ? std::max(value / type.most, -1.0) : value;
  }
};

std::uint32_t word_at(std::string_view bytes, std::size_t at) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + at, sizeof word);
  return word;
}

bool has_extension(const json& object, const char* name) {
  const auto found = object.find("extensions");
  return found != object.end() && found->contains(name);
}

/// A scene's description, and its numbers.
class GltfScene {
 public:
  explicit GltfScene(const MeshFile& file) : file_(file) {
    std::string_view text = file.bytes().starts_with("glTF") ? split_chunks() : file.text();
    if (base::is_json_too_deep(text)) file.refuse("it is nested too deeply; export it again");
    scene_ = json::parse(text, nullptr, /*allow_exceptions=*/false);
    if (!scene_.is_object()) {
      file.refuse(
          "its description is not a complete JSON object; it may be cut off, export it again");
    }
    check_version();
    check_extensions();
  }

  const json& root() const { return scene_; }

  /// scene[list][index].
  const json& item(const char* list, std::size_t index) const {
    const auto found = scene_.find(list);
    if (found == scene_.end() || !found->is_array() || index >= found->size()) {
      file_.refuse(
          fmt::format("it refers to {}[{}], which it does not have; export it again", list, index));
    }
    return (*found)[index];
  }

  std::size_t whole(const json& value, const char* name) const {
    constexpr double kMost = 1e15;
    if (value.is_number_unsigned()) return value.get<std::size_t>();
    if (value.is_number_float()) {
      const auto number = value.get<double>();
      if (number >= 0 && number <= kMost && number == std::floor(number)) {
        return static_cast<std::size_t>(number);
      }
    }
    file_.refuse(fmt::format("its \"{}\" is not a whole number; export it again", name));
  }
  /// object[key], which must be there unless there is a `fallback`.
  std::size_t whole(const json& object, const char* key,
                    const std::optional<std::size_t>& fallback) const {
    const auto found = object.find(key);
    if (found != object.end()) return whole(*found, key);
    if (!fallback) file_.refuse(fmt::format("its \"{}\" is missing; export it again", key));
    return *fallback;
  }

  /// @param shape "SCALAR" or "VEC3".
  Accessor accessor(std::size_t index, std::string_view shape);

  /// Bytes of the file and of those beside it that were read so far.
  std::size_t bytes() const { return file_.bytes().size() + bytes_beside_; }

 private:
  /// The first chunk, which is the description. The second is its first buffer.
  std::string_view split_chunks();
  void check_version() const;
  void check_extensions() const;
  std::string_view buffer(std::size_t index);
  std::string_view named_buffer(const std::string& uri);

  const MeshFile& file_;
  json scene_;
  std::optional<std::string_view> chunk_;
  std::map<std::string, std::string, std::less<>> buffers_;  ///< by place, or by their data's URI
  std::size_t bytes_beside_ = 0;
};

std::string_view GltfScene::split_chunks() {
  constexpr std::size_t kHeader = 12, kChunkHeader = 8;
  constexpr std::uint32_t kJson = 0x4E4F534A, kBinary = 0x004E4942;
  std::string_view bytes = file_.bytes();
  if (bytes.size() < kHeader + kChunkHeader) {
    file_.refuse("it ends within its header; it may be cut off, export it again");
  }
  if (const std::uint32_t version = word_at(bytes, 4); version != 2) {
    file_.refuse(fmt::format("it is of glTF version {}; export it as glTF 2.0", version));
  }
  if (const std::uint32_t promised = word_at(bytes, 8); promised > bytes.size()) {
    file_.refuse(
        fmt::format("its header promises {} bytes and it holds {}; it may be cut off, export it "
                    "again",
                    promised, bytes.size()));
  }
  std::optional<std::string_view> description;
  for (bytes.remove_prefix(kHeader); bytes.size() >= kChunkHeader;) {
    const std::size_t length = word_at(bytes, 0);
    const std::uint32_t type = word_at(bytes, 4);
    bytes.remove_prefix(kChunkHeader);
    if (length > bytes.size()) {
      file_.refuse("a chunk of it is longer than the file; it may be cut off, export it again");
    }
    auto& chunk = description ? chunk_ : description;
    if (!chunk && type == (description ? kBinary : kJson)) chunk = bytes.substr(0, length);
    bytes.remove_prefix(std::min(bytes.size(), (length + 3) / 4 * 4));
    if (!description) break;
  }
  if (!description) file_.refuse("its first chunk is not a description in JSON; export it again");
  return *description;
}

void GltfScene::check_version() const {
  const auto asset = scene_.find("asset");
  if (asset == scene_.end() || !asset->contains("version") || !asset->at("version").is_string()) {
    file_.refuse("it does not say its glTF version (\"asset\"); is it a glTF scene?");
  }
  if (const auto version = asset->at("version").get<std::string>(); !version.starts_with("2.")) {
    file_.refuse(
        fmt::format("it is of glTF version {}; export it as glTF 2.0", base::to_utf8(version)));
  }
}

void GltfScene::check_extensions() const {
  // Those that say nothing about where triangles are.
  constexpr std::string_view kHarmless[] = {"KHR_materials_",      "KHR_texture_",
                                            "EXT_texture_",        "MSFT_texture_",
                                            "KHR_lights_punctual", "KHR_mesh_quantization"};
  const auto required = scene_.find("extensionsRequired");
  if (required == scene_.end() || !required->is_array()) return;
  for (const json& name : *required) {
    const std::string text = name.is_string() ? name.get<std::string>() : name.dump();
    if (text == "KHR_draco_mesh_compression") {
      file_.refuse("its meshes are compressed by Draco; export it without compression");
    }
    if (text.ends_with("_meshopt_compression")) {
      file_.refuse("its meshes are compressed by meshopt; export it without compression");
    }
    if (std::ranges::none_of(kHarmless, [&](auto start) { return text.starts_with(start); })) {
      file_.refuse(
          fmt::format("it needs the extension {}, which is not read here; export it without",
                      base::to_utf8(text)));
    }
  }
}

std::string_view GltfScene::named_buffer(const std::string& uri) {
  const bool is_data = uri.starts_with("data:");
  const std::string name = is_data ? uri : file_.place_beside(uri).generic_string();
  if (const auto known = buffers_.find(name); known != buffers_.end()) return known->second;
  std::string bytes;
  if (is_data) {
    constexpr std::string_view kMark = ";base64,";
    const std::size_t mark = uri.find(kMark);
    auto decoded = mark == std::string::npos
                       ? std::nullopt
                       : base::from_base64(std::string_view(uri).substr(mark + kMark.size()));
    if (!decoded) file_.refuse("a buffer in it is not complete base64; export it again as .glb");
    bytes = std::move(*decoded);
  } else {
    bytes = file_.read_beside(name);
    bytes_beside_ += bytes.size();
    if (bytes_beside_ > kLargestFile) {
      file_.refuse(
          fmt::format("the files that it names have more than {} together; export the scene in "
                      "parts",
                      base::size_text(kLargestFile)));
    }
  }
  return buffers_.emplace(name, std::move(bytes)).first->second;
}

std::string_view GltfScene::buffer(std::size_t index) {
  const json& about = item("buffers", index);
  std::string_view bytes;
  if (const auto uri = about.find("uri"); uri != about.end() && uri->is_string()) {
    bytes = named_buffer(uri->get<std::string>());
  } else if (index == 0 && chunk_) {
    bytes = *chunk_;
  } else {
    file_.refuse(fmt::format("its buffer {} has no data; export it again", index));
  }
  const std::size_t length = whole(about, "byteLength", {});
  if (length > bytes.size()) {
    file_.refuse(
        fmt::format("its buffer {} should have {} bytes and has {}; it may be cut off, export it "
                    "again",
                    index, length, bytes.size()));
  }
  return bytes.substr(0, length);
}

Accessor GltfScene::accessor(std::size_t index, std::string_view shape) {
  const json& about = item("accessors", index);
  const auto refuse = [&](std::string_view what) {
    file_.refuse(fmt::format("its accessor {} {}", index, what));
  };
  if (about.contains("sparse")) refuse("is sparse; export it without sparse accessors");
  if (about.at("type") != json(shape))
    refuse(fmt::format("is not of type {}; export it again", shape));
  if (!about.contains("bufferView")) {
    refuse("has no data of its own (is it compressed?); export it without compression");
  }
  const json& view = item("bufferViews", whole(about, "bufferView", {}));
  if (has_extension(view, "EXT_meshopt_compression") ||
      has_extension(view, "KHR_meshopt_compression")) {
    refuse("is compressed by meshopt; export it without compression");
  }
  const std::size_t code = whole(about, "componentType", {});
  const auto* type = std::ranges::find_if(
      kComponentTypes, [&](const auto& t) { return static_cast<std::size_t>(t.code) == code; });
  if (type == kComponentTypes.end()) {
    refuse(fmt::format("has numbers of an unknown type, {}; export it again", code));
  }
  Accessor found{{}, whole(about, "count", {}), whole(view, "byteStride", 0), *type, false};
  const auto normalized = about.find("normalized");
  found.is_share = normalized != about.end() && *normalized == true;
  const std::size_t element = (shape == "VEC3" ? 3 : 1) * type->size;
  if (found.step == 0) found.step = element;
  std::string_view bytes = buffer(whole(view, "buffer", {}));
  const auto cut = [&](std::size_t offset, std::size_t length) {
    if (offset > bytes.size() || length > bytes.size() - offset) {
      refuse("reaches beyond its buffer; the file may be cut off, export it again");
    }
    bytes = bytes.substr(offset, length);
  };
  cut(whole(view, "byteOffset", 0), whole(view, "byteLength", {}));
  const std::size_t offset = whole(about, "byteOffset", 0);
  cut(offset, bytes.size() - std::min(bytes.size(), offset));
  const bool fits =
      found.count == 0 || (element <= bytes.size() && found.step >= element &&
                           (found.count - 1) <= (bytes.size() - element) / found.step);
  if (!fits) refuse("reaches beyond its buffer; the file may be cut off, export it again");
  found.bytes = bytes;
  return found;
}

/// `count` numbers of an array.
template <int count>
Eigen::Matrix<double, count, 1> numbers(const json& array, const MeshFile& file, const char* name) {
  Eigen::Matrix<double, count, 1> vector;
  if (array.is_array() && array.size() == static_cast<std::size_t>(count)) {
    for (int i = 0; i < count; ++i) {
      const json& number = array[static_cast<std::size_t>(i)];
      vector[i] = number.is_number() ? number.get<double>() : std::nan("");
    }
    if (vector.allFinite()) return vector;
  }
  file.refuse(
      fmt::format("a node's \"{}\" is not {} finite numbers; export it again", name, count));
}

/// From a node's own coordinates to those of its parent.
Eigen::Affine3d node_transform(const json& node, const MeshFile& file) {
  Eigen::Affine3d to_parent = Eigen::Affine3d::Identity();
  if (node.contains("matrix")) {
    const Eigen::Matrix<double, 16, 1> columns = numbers<16>(node["matrix"], file, "matrix");
    to_parent.affine() = Eigen::Map<const Eigen::Matrix4d>(columns.data()).topRows<3>();
    return to_parent;
  }
  if (node.contains("translation")) {
    to_parent.translate(Eigen::Vector3d(numbers<3>(node["translation"], file, "translation")));
  }
  if (node.contains("rotation")) {
    const Eigen::Vector4d q = numbers<4>(node["rotation"], file, "rotation");
    Eigen::Matrix3d turn = Eigen::Quaterniond(q).normalized().toRotationMatrix();
    // A quarter turn is one, though its quaternion is rounded.
    constexpr double kRounding = 1e-7;
    for (double& entry : turn.reshaped()) {
      if (std::abs(entry - std::round(entry)) < kRounding) entry = std::round(entry);
    }
    to_parent.rotate(turn);
  }
  if (node.contains("scale")) {
    to_parent.scale(Eigen::Vector3d(numbers<3>(node["scale"], file, "scale")));
  }
  return to_parent;
}

/// The triangles of a list (mode 4), a strip (5) or a fan (6) of corners.
std::vector<Triangle> triangles_of(const std::vector<std::uint32_t>& corners, std::size_t mode) {
  std::vector<Triangle> triangles;
  if (mode == 4) {
    for (std::size_t i = 2; i < corners.size(); i += 3) {
      triangles.push_back({corners[i - 2], corners[i - 1], corners[i]});
    }
    return triangles;
  }
  for (std::size_t i = 2; i < corners.size(); ++i) {
    if (mode == 6) {
      triangles.push_back({corners[0], corners[i - 1], corners[i]});
    } else {
      const std::size_t odd = i % 2;
      triangles.push_back({corners[i - 2 + odd], corners[i - 1 - odd], corners[i]});
    }
  }
  return triangles;
}

class GltfFaces {
 public:
  explicit GltfFaces(const MeshFile& file)
      : file_(file), scene_(file), faces_(file, scene_.bytes()) {}

  FaceList read() && {
    std::vector<Place> waiting;
    for (const std::size_t root : roots()) waiting.push_back({root, Eigen::Affine3d::Identity()});
    std::vector<bool> seen;
    while (!waiting.empty()) {
      const auto [index, to_scene] = waiting.back();
      waiting.pop_back();
      const json& node = scene_.item("nodes", index);
      seen.resize(std::max(seen.size(), index + 1));
      if (seen[index]) {
        file_.refuse(fmt::format("its node {} has two parents; export it again", index));
      }
      seen[index] = true;
      if (has_extension(node, "EXT_mesh_gpu_instancing")) {
        file_.refuse("it places meshes by EXT_mesh_gpu_instancing; export them as nodes");
      }
      const Eigen::Affine3d place = to_scene * node_transform(node, file_);
      if (node.contains("mesh")) add_mesh(scene_.whole(node, "mesh", {}), place);
      if (!node.contains("children")) continue;
      for (const json& child : node["children"]) {
        waiting.push_back({scene_.whole(child, "children"), place});
      }
    }
    return std::move(faces_).take();
  }

 private:
  struct Place {
    std::size_t node;
    Eigen::Affine3d to_scene;  ///< from its parent
  };

  /// The nodes that the scene shows; where there is no scene, those without a parent.
  std::vector<std::size_t> roots() const {
    std::vector<std::size_t> found;
    const json& root = scene_.root();
    if (root.contains("scenes")) {
      const json& shown = scene_.item("scenes", scene_.whole(root, "scene", 0));
      if (!shown.contains("nodes")) return found;
      for (const json& node : shown["nodes"]) found.push_back(scene_.whole(node, "nodes"));
      return found;
    }
    if (!root.contains("nodes")) return found;
    const json& nodes = root["nodes"];
    std::vector<bool> is_child(nodes.size());
    for (const json& node : nodes) {
      if (!node.contains("children")) continue;
      for (const json& child : node["children"]) {
        const std::size_t index = scene_.whole(child, "children");
        if (index < is_child.size()) is_child[index] = true;
      }
    }
    for (std::size_t i = 0; i < is_child.size(); ++i) {
      if (!is_child[i]) found.push_back(i);
    }
    return found;
  }

  void add_mesh(std::size_t index, const Eigen::Affine3d& place) {
    const json& mesh = scene_.item("meshes", index);
    for (const json& primitive : mesh.at("primitives")) add_primitive(primitive, place);
  }

  void add_primitive(const json& primitive, const Eigen::Affine3d& place) {
    constexpr std::size_t kTriangles = 4, kFan = 6;
    const std::size_t mode = scene_.whole(primitive, "mode", kTriangles);
    const json& attributes = primitive.at("attributes");
    if (mode < kTriangles || mode > kFan || !attributes.contains("POSITION")) return;
    const Accessor places = scene_.accessor(scene_.whole(attributes, "POSITION", {}), "VEC3");
    std::vector<std::uint32_t> corners;
    if (primitive.contains("indices")) {
      const Accessor indices = scene_.accessor(scene_.whole(primitive, "indices", {}), "SCALAR");
      if (indices.type.is_real || indices.is_share) {
        file_.refuse("its indices are not whole numbers; export it again");
      }
      faces_.set_bytes(scene_.bytes());
      faces_.spend(indices.count);
      corners.reserve(indices.count);
      for (std::size_t i = 0; i < indices.count; ++i) {
        const double corner = indices.at(i, 0);
        if (corner < 0) file_.refuse("one of its indices is negative; export it again");
        corners.push_back(static_cast<std::uint32_t>(corner));
      }
    } else {
      faces_.set_bytes(scene_.bytes());
      faces_.spend(places.count);
      corners.resize(places.count);
      std::iota(corners.begin(), corners.end(), 0U);
    }
    faces_.add(
        triangles_of(corners, mode), places.count,
        [&](std::uint32_t v) {
          return Eigen::Vector3d(places.at(v, 0), places.at(v, 1), places.at(v, 2));
        },
        place);
  }

  const MeshFile& file_;
  GltfScene scene_;
  SceneFaces faces_;
};

}  // namespace

FaceList read_gltf(const MeshFile& file, const std::string* /*share*/) {
  try {
    return GltfFaces(file).read();
  } catch (const json::exception& error) {
    file.refuse(fmt::format("its description is not valid glTF 2.0 ({}); export it again",
                            base::to_utf8(error.what())));
  }
}

MeshFormat gltf_format() {
  return {.seems = "a JSON document, such as a map or a .gltf scene",
          .looks_like = [](std::string_view head) { return take_word(head).starts_with('{'); },
          .may_be_another = true,
          .read = read_gltf,
          .up = UpAxis::y};
}

}  // namespace qjulia::shape
