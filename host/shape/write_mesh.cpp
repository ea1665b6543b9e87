#include <fmt/format.h>

#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <mutex>

#include "base/output_file.hpp"
#include "qjulia/error.hpp"
#include "qjulia/file_types.hpp"
#include "qjulia/mesh.hpp"
#include "shape/write_glb.hpp"

namespace qjulia {

using namespace shape;
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
  if (!mesh.normals.empty() && extension != ".stl") {
    options += OpenMesh::IO::Options::VertexNormal;
  }
  constexpr std::streamsize kFloatDigits = 9;  // enough to read the same float back
  return OpenMesh::IO::IOManager().write(out, extension, exporter, options, kFloatDigits);
}

}  // namespace

bool stands_upright(const std::filesystem::path& path) {
  const std::string extension = extension_of(path);
  return extension == ".glb" || extension == ".stl";
}

void write_mesh(const TriangleMesh& mesh, const std::filesystem::path& path,
                const std::string& note, std::optional<UpAxis> up) {
  const std::string extension = expect_type(path, FileContent::mesh, FileUse::write);
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
