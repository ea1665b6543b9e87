#include "shape/write_glb.hpp"

#include <Eigen/Geometry>
#include <array>
#include <bit>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "qjulia/error.hpp"

namespace qjulia::shape {
namespace {

static_assert(std::endian::native == std::endian::little, "the format's byte order");

constexpr int kFloat = 5126;
constexpr int kUnsignedInt = 5125;
constexpr int kArrayBuffer = 34962;
constexpr int kElementArrayBuffer = 34963;

template <class T>
void append(std::string& bytes, const T& value) {
  bytes.append(std::bit_cast<std::array<char, sizeof(T)>>(value).data(), sizeof(T));
}

nlohmann::json accessor(int view, int type, std::size_t count, const char* shape) {
  return {{"bufferView", view}, {"componentType", type}, {"count", count}, {"type", shape}};
}

/// As nodes have it: x, y, z, w.
nlohmann::json rotation(UpAxis up) {
  const Eigen::Quaterniond q(quarter_turns(up, UpAxis::y));
  return {q.x(), q.y(), q.z(), q.w()};
}

/// The JSON that describes a buffer of indices, positions and normals, in this order.
nlohmann::json description(const TriangleMesh& mesh, UpAxis up, std::size_t bytes) {
  const std::size_t indices = 12 * mesh.triangles.size();
  const std::size_t positions = 12 * mesh.vertices.size();
  nlohmann::json views = {
      {{"buffer", 0}, {"byteOffset", 0}, {"byteLength", indices}, {"target", kElementArrayBuffer}},
      {{"buffer", 0},
       {"byteOffset", indices},
       {"byteLength", positions},
       {"target", kArrayBuffer}}};
  const Box box = mesh.box();
  const Eigen::Vector3f low = box.low.cast<float>();
  const Eigen::Vector3f high = box.high.cast<float>();
  nlohmann::json accessors = {accessor(0, kUnsignedInt, 3 * mesh.triangles.size(), "SCALAR"),
                              accessor(1, kFloat, mesh.vertices.size(), "VEC3")};
  accessors[1]["min"] = {low.x(), low.y(), low.z()};
  accessors[1]["max"] = {high.x(), high.y(), high.z()};
  nlohmann::json attributes = {{"POSITION", 1}};
  if (!mesh.normals.empty()) {
    views.push_back({{"buffer", 0},
                     {"byteOffset", indices + positions},
                     {"byteLength", positions},
                     {"target", kArrayBuffer}});
    accessors.push_back(accessor(2, kFloat, mesh.vertices.size(), "VEC3"));
    attributes["NORMAL"] = 2;
  }
  return {
      {"asset", {{"version", "2.0"}, {"generator", "qjulia"}}},
      {"scene", 0},
      {"scenes", {{{"nodes", {0}}}}},
      {"nodes", {{{"mesh", 0}, {"rotation", rotation(up)}}}},
      {"meshes", {{{"primitives", {{{"attributes", attributes}, {"indices", 0}, {"mode", 4}}}}}}},
      {"buffers", {{{"byteLength", bytes}}}},
      {"bufferViews", views},
      {"accessors", accessors}};
}

}  // namespace

void write_glb(const TriangleMesh& mesh, const std::string& note, UpAxis up, std::ostream& out) {
  const std::size_t vectors = mesh.vertices.size() + mesh.normals.size();
  const std::size_t bytes = 12 * (mesh.triangles.size() + vectors);
  nlohmann::json about = description(mesh, up, bytes);
  if (!note.empty()) about["asset"]["extras"] = {{"made_with", note}};
  std::string json = about.dump();
  json.append((4 - json.size() % 4) % 4, ' ');
  const std::size_t total = 12 + 8 + json.size() + 8 + bytes;
  if (total > std::numeric_limits<std::uint32_t>::max()) {
    throw OutputError("the mesh is larger than the 4 GiB a .glb file can hold; write .ply");
  }
  const auto u32 = [](std::size_t value) { return static_cast<std::uint32_t>(value); };
  std::string head;
  for (const std::uint32_t word : {std::uint32_t{0x46546C67}, std::uint32_t{2}, u32(total),
                                   u32(json.size()), std::uint32_t{0x4E4F534A}}) {
    append(head, word);
  }
  head += json;
  append(head, u32(bytes));
  append(head, std::uint32_t{0x004E4942});
  out << head;
  std::string chunk;
  const auto flush = [&](std::size_t least) {
    if (chunk.size() < least) return;
    out.write(chunk.data(), static_cast<std::streamsize>(chunk.size()));
    chunk.clear();
  };
  constexpr std::size_t kChunk = std::size_t{1} << 20;
  for (const Triangle& t : mesh.triangles) {
    for (const auto v : t) append(chunk, v);
    flush(kChunk);
  }
  for (const Eigen::Vector3d& x : mesh.vertices) {
    for (const double c : x) append(chunk, static_cast<float>(c));
    flush(kChunk);
  }
  for (const Eigen::Vector3f& n : mesh.normals) {
    for (const float c : n) append(chunk, c);
    flush(kChunk);
  }
  flush(0);
}

}  // namespace qjulia::shape
