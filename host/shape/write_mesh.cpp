#include <fmt/format.h>

#include <Eigen/Geometry>
#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>

#include "base/output_file.hpp"
#include "qjulia/error.hpp"
#include "qjulia/file_types.hpp"
#include "qjulia/mesh.hpp"

namespace qjulia {
namespace {

using OpenMesh::FaceHandle;
using OpenMesh::VertexHandle;
using EmptyMesh = OpenMesh::TriMesh_ArrayKernelT<>;
using Exporter = OpenMesh::IO::ExporterT<EmptyMesh>;

/// OpenMesh's writers are one of each kind, with state of their own: one thread at a
/// time. They also write to the standard streams; a library must not.
class WriterLock {
 public:
  WriterLock() {
    for (auto* stream : {&omlog(), &omout(), &omerr()}) stream->disable();
  }
  ~WriterLock() {
    for (auto* stream : {&omlog(), &omout(), &omerr()}) stream->enable();
  }
  WriterLock(const WriterLock&) = delete;
  WriterLock& operator=(const WriterLock&) = delete;

 private:
  static inline std::mutex mutex_;
  std::lock_guard<std::mutex> lock_{mutex_};
};

/// Shows a list of triangles to a writer, turned where a turn is given.
class TriangleExporter : public Exporter {
 public:
  TriangleExporter(const EmptyMesh& unused, const TriangleMesh& mesh,
                   const std::optional<Eigen::Matrix3d>& turn)
      : Exporter(unused), mesh_(mesh), turn_(turn) {}

  OpenMesh::Vec3f point(VertexHandle v) const override { return OpenMesh::Vec3f(pointd(v)); }
  OpenMesh::Vec3d pointd(VertexHandle v) const override {
    Eigen::Vector3d x = mesh_.vertices[static_cast<std::size_t>(v.idx())];
    if (turn_) x = *turn_ * x;
    return {x.x(), x.y(), x.z()};
  }
  unsigned get_vhandles(FaceHandle f, std::vector<VertexHandle>& corners) const override {
    corners.clear();
    for (const auto v : mesh_.triangles[static_cast<std::size_t>(f.idx())]) {
      corners.emplace_back(static_cast<int>(v));
    }
    return 3;
  }
  OpenMesh::Vec3f normal(VertexHandle v) const override {
    // The .off writer asks whether or not it writes them.
    if (mesh_.normals.empty()) return {0, 0, 0};
    Eigen::Vector3f n = mesh_.normals[static_cast<std::size_t>(v.idx())];
    if (turn_) n = turn_->cast<float>() * n;
    return {n.x(), n.y(), n.z()};
  }
  bool has_vertex_normals() const override { return !mesh_.normals.empty(); }
  std::size_t n_vertices() const override { return mesh_.vertices.size(); }
  std::size_t n_faces() const override { return mesh_.triangles.size(); }

 private:
  const TriangleMesh& mesh_;
  std::optional<Eigen::Matrix3d> turn_;
};

/// Coordinates pass through single precision. @return false when OpenMesh could not write.
bool write_with_openmesh(const TriangleMesh& mesh, const std::optional<Eigen::Matrix3d>& turn,
                         const std::string& extension, std::ostream& out) {
  const WriterLock lock;
  const EmptyMesh unused;
  TriangleExporter exporter(unused, mesh, turn);
  OpenMesh::IO::Options options;
  if (extension == ".ply" || extension == ".stl") options += OpenMesh::IO::Options::Binary;
  // Many readers of .off know no normals and refuse a file that starts with "NOFF".
  if (!mesh.normals.empty() && (extension == ".ply" || extension == ".obj")) {
    options += OpenMesh::IO::Options::VertexNormal;
  }
  constexpr std::streamsize kFloatDigits = 9;  // enough to read the same float back
  return OpenMesh::IO::IOManager().write(out, extension, exporter, options, kFloatDigits);
}

static_assert(std::endian::native == std::endian::little, "the byte order of .glb");

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

/// Binary glTF 2.0: one mesh of one primitive, Y up as the format wants it: the node is turned so
/// that the mesh's `up` is. https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html
/// @param note stands under asset.extras.made_with, unless empty.
/// @throws OutputError beyond 4 GiB, which the format cannot hold.
void write_glb(const TriangleMesh& mesh, const std::string& note, UpAxis up, std::ostream& out) {
  const std::size_t vectors = mesh.vertices.size() + mesh.normals.size();
  const std::size_t bytes = 12 * (mesh.triangles.size() + vectors);
  nlohmann::json about = description(mesh, up, bytes);
  if (!note.empty()) about["asset"]["extras"] = {{"made_with", note}};
  // File names in the note may hold any bytes.
  std::string json = about.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  json.append((4 - json.size() % 4) % 4, ' ');
  const std::size_t total = 12 + 8 + json.size() + 8 + bytes;
  if (total > std::numeric_limits<std::uint32_t>::max()) {
    throw OutputError("the mesh is larger than the 4 GiB a .glb file can hold; write .ply");
  }
  std::string head;
  const auto add = [&](std::size_t word) { append(head, static_cast<std::uint32_t>(word)); };
  const std::size_t words[] = {0x46546C67, 2, total, json.size(), 0x4E4F534A};
  std::ranges::for_each(words, add);
  head += json;
  add(bytes);
  add(0x004E4942);
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

}  // namespace

bool stands_upright(const std::filesystem::path& path) {
  const std::string extension = extension_of(path);
  return extension == ".glb" || extension == ".stl";
}

void write_mesh(const TriangleMesh& mesh, const std::filesystem::path& path,
                const std::string& note, std::optional<UpAxis> up) {
  const std::string extension = expect_type(path, FileContent::mesh, FileUse::write);
  mesh.validate();
  base::OutputFile file(path);
  if (extension == ".obj" && !note.empty()) file.stream() << "# " << note << '\n';
  if (extension == ".glb") {
    write_glb(mesh, note, up.value_or(UpAxis::z), file.stream());
    file.commit();
    return;
  }
  std::optional<Eigen::Matrix3d> turn;
  if (extension == ".stl" && up && up != UpAxis::z) turn = quarter_turns(*up, UpAxis::z);
  if (!write_with_openmesh(mesh, turn, extension, file.stream())) {
    throw OutputError(fmt::format("cannot write mesh '{}'; check the space left", path.string()));
  }
  file.commit();
}

}  // namespace qjulia
