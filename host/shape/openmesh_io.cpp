#include "shape/openmesh_io.hpp"

#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <mutex>
#include <sstream>

namespace qjulia {
namespace {

using OpenMesh::FaceHandle;
using OpenMesh::VertexHandle;
using EmptyMesh = OpenMesh::TriMesh_ArrayKernelT<>;
using Importer = OpenMesh::IO::ImporterT<EmptyMesh>;
using Exporter = OpenMesh::IO::ExporterT<EmptyMesh>;

/// OpenMesh's readers and writers are one of each kind, with state of their own: one thread at a
/// time. They also write to the standard streams; a library must not.
class Alone {
 public:
  Alone() {
    for (auto* stream : {&omlog(), &omout(), &omerr()}) stream->disable();
  }
  ~Alone() {
    for (auto* stream : {&omlog(), &omout(), &omerr()}) stream->enable();
  }
  Alone(const Alone&) = delete;
  Alone& operator=(const Alone&) = delete;

 private:
  static inline std::mutex mutex_;
  std::lock_guard<std::mutex> lock_{mutex_};
};

/// Takes vertices and faces as the reader meets them. Faces are answered with no handle, so that
/// readers attach nothing to them.
class TriangleImporter : public Importer {
 public:
  TriangleImporter(EmptyMesh& unused, TriangleMesh& mesh) : Importer(unused), mesh_(mesh) {}

  VertexHandle add_vertex(const OpenMesh::Vec3f& x) override {
    mesh_.vertices.emplace_back(x[0], x[1], x[2]);
    return VertexHandle(static_cast<int>(mesh_.vertices.size()) - 1);
  }
  VertexHandle add_vertex(const OpenMesh::Vec3d& x) override {
    return add_vertex(OpenMesh::Vec3f(x));
  }
  VertexHandle add_vertex() override { return add_vertex(OpenMesh::Vec3f(0, 0, 0)); }
  void set_point(VertexHandle v, const OpenMesh::Vec3f& x) override {
    mesh_.vertices.at(static_cast<std::size_t>(v.idx())) = {x[0], x[1], x[2]};
  }
  FaceHandle add_face(const VHandles& corners) override {
    ++faces_;
    const auto at = [&](std::size_t i) { return static_cast<std::uint32_t>(corners[i].idx()); };
    for (std::size_t i = 2; i < corners.size(); ++i) {
      mesh_.triangles.push_back({at(0), at(i - 1), at(i)});
    }
    return FaceHandle();
  }
  void reserve(unsigned, unsigned, unsigned) override {}
  std::size_t n_vertices() const override { return mesh_.vertices.size(); }
  std::size_t n_faces() const override { return faces_; }

 private:
  TriangleMesh& mesh_;
  std::size_t faces_ = 0;
};

/// Shows a list of triangles to a writer.
class TriangleExporter : public Exporter {
 public:
  TriangleExporter(const EmptyMesh& unused, const TriangleMesh& mesh)
      : Exporter(unused), mesh_(mesh) {}

  OpenMesh::Vec3f point(VertexHandle v) const override { return OpenMesh::Vec3f(pointd(v)); }
  OpenMesh::Vec3d pointd(VertexHandle v) const override {
    const auto& x = mesh_.vertices[static_cast<std::size_t>(v.idx())];
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
    const auto& n = mesh_.normals[static_cast<std::size_t>(v.idx())];
    return {n.x(), n.y(), n.z()};
  }
  bool has_vertex_normals() const override { return !mesh_.normals.empty(); }
  std::size_t n_vertices() const override { return mesh_.vertices.size(); }
  std::size_t n_faces() const override { return mesh_.triangles.size(); }

 private:
  const TriangleMesh& mesh_;
};

}  // namespace

bool read_with_openmesh(const CheckedMesh& checked, const std::string& extension,
                        TriangleMesh& mesh) {
  const Alone alone;
  EmptyMesh unused;
  TriangleImporter importer(unused, mesh);
  std::istringstream in(checked.bytes);
  OpenMesh::IO::Options options;
  if (checked.is_binary) options += OpenMesh::IO::Options::Binary;
  if (!OpenMesh::IO::IOManager().read(in, extension, importer, options)) return false;
  if (extension == ".stl") return importer.n_faces() <= checked.faces;
  return importer.n_vertices() == checked.vertices && importer.n_faces() == checked.faces;
}

bool write_with_openmesh(const TriangleMesh& mesh, const std::string& extension,
                         std::ostream& out) {
  const Alone alone;
  const EmptyMesh unused;
  TriangleExporter exporter(unused, mesh);
  OpenMesh::IO::Options options;
  if (extension == ".ply" || extension == ".stl") options += OpenMesh::IO::Options::Binary;
  if (!mesh.normals.empty() && extension != ".stl") {
    options += OpenMesh::IO::Options::VertexNormal;
  }
  constexpr std::streamsize kFloatDigits = 9;  // enough to read the same float back
  return OpenMesh::IO::IOManager().write(out, extension, exporter, options, kFloatDigits);
}

}  // namespace qjulia
