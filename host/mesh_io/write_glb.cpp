#include "mesh_io/write_glb.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <tuple>
#include <utility>

#include "base/map_chunk.hpp"
#include "base/srgb.hpp"
#include "mesh_io/formats.hpp"
#include "mesh_io/record_stream.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::shape {
namespace {

constexpr int kFloat = 5126;
constexpr int kUnsignedByte = 5121;
constexpr int kUnsignedInt = 5125;
constexpr int kArrayBuffer = 34962;
constexpr int kElementArrayBuffer = 34963;

/// A node's rotation: x, y, z, w.
nlohmann::json rotation(UpAxis up) {
  const Eigen::Quaterniond q(quarter_turns(up, UpAxis::y));
  return {q.x(), q.y(), q.z(), q.w()};
}

/// The binary buffer of a file, and what the JSON says of its parts.
class Buffer {
 public:
  /// Room for `count` vectors of `components` numbers of this type; `add` writes them.
  /// @param target what reads them; 0: animations do. @return the index of the accessor
  int accessor(int component, std::size_t size, std::size_t components, std::size_t count,
               const char* shape, int target) {
    accessors.push_back({{"bufferView", view(size * components * count)},
                         {"componentType", component},
                         {"count", count},
                         {"type", shape}});
    if (target != 0) views.back()["target"] = target;
    return static_cast<int>(accessors.size()) - 1;
  }

  /// A picture's bytes. @return the index of the texture
  int texture(const std::string& png) {
    images.push_back({{"bufferView", view(png.size())}, {"mimeType", "image/png"}});
    textures.push_back({{"source", images.size() - 1}, {"sampler", 0}});
    return static_cast<int>(textures.size()) - 1;
  }

  std::size_t bytes = 0;  ///< a multiple of 4
  nlohmann::json views = nlohmann::json::array(), accessors = views, images = views,
                 textures = views;

 private:
  /// @return the index of a new view of so many bytes. Views begin at multiples of 4.
  std::size_t view(std::size_t length) {
    views.push_back({{"buffer", 0}, {"byteOffset", bytes}, {"byteLength", length}});
    bytes += length + (4 - length % 4) % 4;
    return views.size() - 1;
  }
};

/// Neither metal nor glossy.
nlohmann::json plain_material(const char* name) {
  return {{"name", name},
          {"pbrMetallicRoughness",
           {{"baseColorFactor", {1, 1, 1, 1}}, {"metallicFactor", 0}, {"roughnessFactor", 0.7}}}};
}

nlohmann::json textured_material(const MeshTexture& texture, Buffer& buffer) {
  nlohmann::json material = plain_material("baked");
  if (!texture.color.empty()) {
    material["pbrMetallicRoughness"]["baseColorTexture"] = {
        {"index", buffer.texture(texture.color)}};
  }
  material["normalTexture"] = {{"index", buffer.texture(texture.normal)}};
  return material;
}

/// A primitive of the mesh, and room for its indices, positions, normals and colours.
nlohmann::json primitive_of(const TriangleMesh& mesh, Buffer& buffer) {
  constexpr std::size_t kReal = 4;
  const std::size_t vertices = mesh.vertices.size();
  const auto vectors = [&](std::size_t components, const char* shape) {
    return buffer.accessor(kFloat, kReal, components, vertices, shape, kArrayBuffer);
  };
  nlohmann::json primitive = {{"mode", 4}};
  primitive["indices"] = buffer.accessor(kUnsignedInt, kReal, 1, 3 * mesh.triangles.size(),
                                         "SCALAR", kElementArrayBuffer);
  nlohmann::json& attributes = primitive["attributes"];
  attributes["POSITION"] = vectors(3, "VEC3");
  const Box box = mesh.box();
  const Eigen::Vector3f low = box.low.cast<float>(), high = box.high.cast<float>();
  buffer.accessors.back()["min"] = {low.x(), low.y(), low.z()};
  buffer.accessors.back()["max"] = {high.x(), high.y(), high.z()};
  if (!mesh.normals.empty()) attributes["NORMAL"] = vectors(3, "VEC3");
  if (!mesh.colors.empty()) {
    attributes["COLOR_0"] = buffer.accessor(kUnsignedByte, 1, 4, vertices, "VEC4", kArrayBuffer);
    buffer.accessors.back()["normalized"] = true;
  }
  return primitive;
}

/// The JSON that describes a buffer of indices, positions, normals, and colours or places in
/// pictures, tangents and the pictures, in this order.
nlohmann::json description(const TriangleMesh& mesh, const MeshTexture* texture,
                           const std::string& name, const nlohmann::json& node, Buffer& buffer) {
  constexpr std::size_t kReal = 4;
  const auto vectors = [&](std::size_t components, const char* shape) {
    return buffer.accessor(kFloat, kReal, components, mesh.vertices.size(), shape, kArrayBuffer);
  };
  nlohmann::json primitive = primitive_of(mesh, buffer);
  nlohmann::json& attributes = primitive["attributes"];
  nlohmann::json scene = {{"asset", {{"version", "2.0"}, {"generator", "qjulia"}}},
                          {"scene", 0},
                          {"scenes", {{{"nodes", {0}}}}},
                          {"nodes", nlohmann::json::array({node})}};
  if (!mesh.colors.empty()) {
    scene["materials"] = nlohmann::json::array({plain_material("vertex colours")});
  }
  if (texture != nullptr) {
    attributes["TEXCOORD_0"] = vectors(2, "VEC2");
    if (!texture->tangents.empty()) attributes["TANGENT"] = vectors(4, "VEC4");
    scene["materials"] = nlohmann::json::array({textured_material(*texture, buffer)});
    // Reduced copies of the pictures would mix triangles that are no neighbours.
    constexpr int kLinear = 9729, kClampToEdge = 33071;
    scene["samplers"] = {{{"magFilter", kLinear},
                          {"minFilter", kLinear},
                          {"wrapS", kClampToEdge},
                          {"wrapT", kClampToEdge}}};
    scene["images"] = buffer.images;
    scene["textures"] = buffer.textures;
  }
  if (scene.contains("materials")) primitive["material"] = 0;
  scene["meshes"] = {{{"name", name}, {"primitives", nlohmann::json::array({primitive})}}};
  scene["buffers"] = {{{"byteLength", buffer.bytes}}};
  scene["bufferViews"] = buffer.views;
  scene["accessors"] = buffer.accessors;
  return scene;
}

/// The mesh with three vertices for each triangle, without colours.
TriangleMesh split(const TriangleMesh& mesh) {
  TriangleMesh all;
  for (const Triangle& triangle : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(all.vertices.size());
    all.triangles.push_back({first, first + 1, first + 2});
    for (const std::uint32_t v : triangle) {
      all.vertices.push_back(mesh.vertices[v]);
      all.normals.push_back(mesh.normals[v]);
    }
  }
  return all;
}

/// Begins a .glb file: all before the buffer's bytes, which come next. @param map in a chunk of its
/// own after the buffer, padded; empty: none
void begin_glb(RecordStream& file, nlohmann::json about, const std::string& note, std::size_t bytes,
               const std::string& map) {
  if (!note.empty()) about["asset"]["extras"] = {{"made_with", note}};
  // File names in the note may hold any bytes.
  std::string text = about.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  text.append((4 - text.size() % 4) % 4, ' ');
  const std::size_t map_bytes = map.empty() ? 0 : 8 + map.size();
  const std::size_t total = 12 + 8 + text.size() + 8 + bytes + map_bytes;
  if (total > std::numeric_limits<std::uint32_t>::max()) {
    throw OutputError("the mesh is larger than the 4 GiB a .glb file can hold; write .ply");
  }
  const auto add = [&](std::size_t word) { file.add(static_cast<std::uint32_t>(word)); };
  constexpr std::size_t kMagic = 0x46546C67, kVersion = 2, kJson = 0x4E4F534A, kBinary = 0x004E4942;
  for (const std::size_t word : {kMagic, kVersion, total, text.size(), kJson}) add(word);
  file.print("{}", text);
  for (const std::size_t word : {bytes, kBinary}) add(word);
}

/// @param map padded
void end_glb(RecordStream& file, const std::string& map) {
  if (map.empty()) return;
  file.add(static_cast<std::uint32_t>(map.size()));
  file.print("{}{}", base::kGlbMapChunk, map);
}

std::string padded(std::string bytes) {
  bytes.append((4 - bytes.size() % 4) % 4, '\0');
  return bytes;
}

/// Indices, positions, normals and colours, as `primitive_of` describes them.
void add_vertices(const TriangleMesh& mesh, RecordStream& file) {
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
}

void add_picture(const std::string& png, RecordStream& file) {
  file.print("{}{}", png, std::string((4 - png.size() % 4) % 4, '\0'));
}

}  // namespace

void write_glb(const TriangleMesh& whole, const std::string& name, const std::string& note,
               UpAxis up, double scale, const std::string& map, const MeshTexture* texture,
               std::ostream& out) {
  const TriangleMesh parted = texture != nullptr ? split(whole) : TriangleMesh();
  const TriangleMesh& mesh = texture != nullptr ? parted : whole;
  Buffer buffer;
  nlohmann::json node = {{"name", name}, {"mesh", 0}, {"rotation", rotation(up)}};
  if (scale != 1) node["scale"] = {scale, scale, scale};
  nlohmann::json about = description(mesh, texture, name, node, buffer);
  const std::size_t bytes = buffer.bytes;
  const std::string map_data = padded(map);
  RecordStream file(out);
  begin_glb(file, std::move(about), note, bytes, map_data);
  add_vertices(mesh, file);
  if (texture != nullptr) {
    for (const Eigen::Vector2f& place : texture->places) {
      for (const float c : place) file.add(c);
    }
    for (const Eigen::Vector4f& tangent : texture->tangents) {
      for (const float c : tangent) file.add(c);
    }
    if (!texture->color.empty()) add_picture(texture->color, file);
    add_picture(texture->normal, file);
  }
  end_glb(file, map_data);
}

void write_moving_glb(const MovingMesh& moving, const std::string& name, const std::string& note,
                      UpAxis up, double scale, const std::string& map, std::ostream& out) {
  Buffer buffer;
  nlohmann::json nodes = nlohmann::json::array(), meshes = nodes, children = nodes,
                 samplers = nodes, channels = nodes;
  nodes.push_back({{"name", name}, {"rotation", rotation(up)}});
  if (scale != 1) nodes[0]["scale"] = {scale, scale, scale};
  constexpr std::size_t kReal = 4;
  int times = -1;  // the accessor of all animations, once there is one
  for (const MovingBody& body : moving.bodies) {
    const std::size_t number = meshes.size();
    const std::string own = fmt::format("{}_{:04}", name, number);
    nlohmann::json primitive = primitive_of(body.mesh, buffer);
    if (!body.mesh.colors.empty()) primitive["material"] = 0;
    meshes.push_back({{"name", own}, {"primitives", nlohmann::json::array({primitive})}});
    const Eigen::Vector3d& at = body.poses.front().place;
    const Eigen::Quaterniond& turn = body.poses.front().turn;
    children.push_back(nodes.size());
    nodes.push_back({{"name", own},
                     {"mesh", number},
                     {"translation", {at.x(), at.y(), at.z()}},
                     {"rotation", {turn.x(), turn.y(), turn.z(), turn.w()}}});
    if (body.poses.size() == 1) continue;
    if (times < 0) {
      times = buffer.accessor(kFloat, kReal, 1, moving.moments, "SCALAR", 0);
      buffer.accessors.back()["min"] = {0};
      buffer.accessors.back()["max"] = {
          static_cast<float>(static_cast<double>(moving.moments - 1) / moving.rate)};
    }
    for (const auto& [path, numbers, shape] :
         {std::tuple("translation", 3, "VEC3"), std::tuple("rotation", 4, "VEC4")}) {
      const int values = buffer.accessor(kFloat, kReal, static_cast<std::size_t>(numbers),
                                         moving.moments, shape, 0);
      channels.push_back(
          {{"sampler", samplers.size()}, {"target", {{"node", nodes.size() - 1}, {"path", path}}}});
      samplers.push_back({{"input", times}, {"output", values}, {"interpolation", "LINEAR"}});
    }
  }
  nodes[0]["children"] = std::move(children);
  nlohmann::json about = {{"asset", {{"version", "2.0"}, {"generator", "qjulia"}}},
                          {"scene", 0},
                          {"scenes", {{{"nodes", {0}}}}},
                          {"nodes", std::move(nodes)},
                          {"meshes", std::move(meshes)},
                          {"buffers", {{{"byteLength", buffer.bytes}}}},
                          {"bufferViews", buffer.views},
                          {"accessors", buffer.accessors}};
  if (std::ranges::any_of(moving.bodies, [](const auto& b) { return !b.mesh.colors.empty(); })) {
    about["materials"] = nlohmann::json::array({plain_material("vertex colours")});
  }
  if (!channels.empty()) {
    about["animations"] =
        nlohmann::json::array({nlohmann::json{{"name", "scatter"},
                                              {"channels", std::move(channels)},
                                              {"samplers", std::move(samplers)}}});
  }
  const std::string map_data = padded(map);
  RecordStream file(out);
  begin_glb(file, std::move(about), note, buffer.bytes, map_data);
  bool has_times = false;
  for (const MovingBody& body : moving.bodies) {
    add_vertices(body.mesh, file);
    if (body.poses.size() == 1) continue;
    for (std::size_t i = 0; !has_times && i < moving.moments; ++i) {
      file.add(static_cast<float>(static_cast<double>(i) / moving.rate));
    }
    has_times = true;
    for (const BodyPose& pose : body.poses) {
      for (const double c : pose.place) file.add(static_cast<float>(c));
    }
    for (const BodyPose& pose : body.poses) {
      for (const double c : pose.turn.coeffs()) file.add(static_cast<float>(c));  // x, y, z, w
    }
  }
  end_glb(file, map_data);
}

MeshFormat glb_format() {
  return {.seems = "a binary glTF scene",
          .looks_like = [](std::string_view head) { return head.starts_with("glTF"); },
          .read = read_gltf,
          .write =
              [](const TriangleMesh& mesh, const MeshWriting& how, std::ostream& out) {
                write_glb(mesh, how.name, how.options.note, how.up(),
                          how.options.metres_per_unit.value_or(1), how.options.map, how.texture,
                          out);
              },
          .up = UpAxis::y,
          .has_colors = true,
          .has_texture = true};
}

}  // namespace qjulia::shape
