#include "mesh_io/write_glb.hpp"

#include <Eigen/Geometry>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "base/map_chunk.hpp"
#include "base/srgb.hpp"
#include "mesh_io/record_stream.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::shape {
namespace {

constexpr int kFloat = 5126;
constexpr int kUnsignedByte = 5121;
constexpr int kUnsignedInt = 5125;
constexpr int kArrayBuffer = 34962;
constexpr int kElementArrayBuffer = 34963;

nlohmann::json accessor(int view, int type, std::size_t count, const char* shape) {
  return {{"bufferView", view}, {"componentType", type}, {"count", count}, {"type", shape}};
}

/// A node's rotation: x, y, z, w.
nlohmann::json rotation(UpAxis up) {
  const Eigen::Quaterniond q(quarter_turns(up, UpAxis::y));
  return {q.x(), q.y(), q.z(), q.w()};
}

/// Neither metal nor glossy.
nlohmann::json plain_material() {
  return {{"name", "vertex colours"},
          {"pbrMetallicRoughness",
           {{"baseColorFactor", {1, 1, 1, 1}}, {"metallicFactor", 0}, {"roughnessFactor", 0.7}}}};
}

/// The JSON that describes a buffer of indices, positions, normals and colours, in this order.
nlohmann::json description(const TriangleMesh& mesh, const std::string& name,
                           const nlohmann::json& node, std::size_t bytes) {
  const std::size_t indices = 12 * mesh.triangles.size();
  const std::size_t positions = 12 * mesh.vertices.size();
  const auto view = [](std::size_t offset, std::size_t length, int target) -> nlohmann::json {
    return {{"buffer", 0}, {"byteOffset", offset}, {"byteLength", length}, {"target", target}};
  };
  nlohmann::json views = {view(0, indices, kElementArrayBuffer),
                          view(indices, positions, kArrayBuffer)};
  const Box box = mesh.box();
  const Eigen::Vector3f low = box.low.cast<float>();
  const Eigen::Vector3f high = box.high.cast<float>();
  nlohmann::json accessors = {accessor(0, kUnsignedInt, 3 * mesh.triangles.size(), "SCALAR"),
                              accessor(1, kFloat, mesh.vertices.size(), "VEC3")};
  accessors[1]["min"] = {low.x(), low.y(), low.z()};
  accessors[1]["max"] = {high.x(), high.y(), high.z()};
  nlohmann::json attributes = {{"POSITION", 1}};
  if (!mesh.normals.empty()) {
    views.push_back(view(indices + positions, positions, kArrayBuffer));
    accessors.push_back(accessor(2, kFloat, mesh.vertices.size(), "VEC3"));
    attributes["NORMAL"] = 2;
  }
  nlohmann::json primitive = {{"indices", 0}, {"mode", 4}};
  if (!mesh.colors.empty()) {
    const std::size_t length = 4 * mesh.colors.size();
    attributes["COLOR_0"] = accessors.size();
    accessors.push_back(
        accessor(static_cast<int>(views.size()), kUnsignedByte, mesh.colors.size(), "VEC4"));
    accessors.back()["normalized"] = true;
    views.push_back(view(bytes - length, length, kArrayBuffer));
    primitive["material"] = 0;
  }
  primitive["attributes"] = attributes;
  nlohmann::json scene = {
      {"asset", {{"version", "2.0"}, {"generator", "qjulia"}}},
      {"scene", 0},
      {"scenes", {{{"nodes", {0}}}}},
      {"nodes", nlohmann::json::array({node})},
      {"meshes", {{{"name", name}, {"primitives", nlohmann::json::array({primitive})}}}},
      {"buffers", {{{"byteLength", bytes}}}},
      {"bufferViews", views},
      {"accessors", accessors}};
  if (!mesh.colors.empty()) scene["materials"] = nlohmann::json::array({plain_material()});
  return scene;
}

}  // namespace

void write_glb(const TriangleMesh& mesh, const std::string& name, const std::string& note,
               UpAxis up, double scale, const std::string& map, std::ostream& out) {
  const std::size_t vectors = mesh.vertices.size() + mesh.normals.size();
  const std::size_t bytes = 12 * (mesh.triangles.size() + vectors) + 4 * mesh.colors.size();
  nlohmann::json node = {{"name", name}, {"mesh", 0}, {"rotation", rotation(up)}};
  if (scale != 1) node["scale"] = {scale, scale, scale};
  nlohmann::json about = description(mesh, name, node, bytes);
  if (!note.empty()) about["asset"]["extras"] = {{"made_with", note}};
  // File names in the note may hold any bytes.
  std::string json = about.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  json.append((4 - json.size() % 4) % 4, ' ');
  std::string map_data = map;
  map_data.append((4 - map.size() % 4) % 4, '\0');
  const std::size_t map_bytes = map.empty() ? 0 : 8 + map_data.size();
  const std::size_t total = 12 + 8 + json.size() + 8 + bytes + map_bytes;
  if (total > std::numeric_limits<std::uint32_t>::max()) {
    throw OutputError("the mesh is larger than the 4 GiB a .glb file can hold; write .ply");
  }
  RecordStream file(out);
  const auto add = [&](std::size_t word) { file.add(static_cast<std::uint32_t>(word)); };
  constexpr std::size_t kMagic = 0x46546C67, kVersion = 2, kJson = 0x4E4F534A, kBinary = 0x004E4942;
  for (const std::size_t word : {kMagic, kVersion, total, json.size(), kJson}) add(word);
  file.print("{}", json);
  for (const std::size_t word : {bytes, kBinary}) add(word);
  for (const Triangle& t : mesh.triangles) file.add(t);
  for (const Eigen::Vector3d& x : mesh.vertices) {
    for (const double c : x) file.add(static_cast<float>(c));
  }
  for (const Eigen::Vector3f& n : mesh.normals) {
    for (const float c : n) file.add(c);
  }
  constexpr std::uint8_t kOpaque = 255;
  const auto linear = [](std::uint8_t c) { return base::byte_of(base::srgb_decoded(c / 255.0)); };
  for (const auto& [red, green, blue] : mesh.colors) {
    file.add(std::array{linear(red), linear(green), linear(blue), kOpaque});
  }
  if (map.empty()) return;
  add(map_data.size());
  file.print("{}{}", base::kGlbMapChunk, map_data);
}

}  // namespace qjulia::shape
