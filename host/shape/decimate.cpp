#include "qjulia/decimate.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/Utils/Property.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModBaseT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalFlippingT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>
#include <cmath>
#include <mutex>
#include <optional>

#include "qjulia/error.hpp"
#include "qjulia/progress.hpp"

namespace qjulia {
namespace {

struct DoubleTraits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
};
using HalfEdgeMesh = OpenMesh::TriMesh_ArrayKernelT<DoubleTraits>;
using Decimater = OpenMesh::Decimater::DecimaterT<HalfEdgeMesh>;

constexpr std::size_t kCollapsesPolled = 1024;

/// Ends the decimation when a stop is asked for.
class StopObserver : public OpenMesh::Decimater::Observer {
 public:
  explicit StopObserver(const std::stop_token& stop) : Observer(kCollapsesPolled), stop_(stop) {}
  void notify(std::size_t /*step*/) override {}
  bool abort() const override { return stop_.stop_requested(); }

 private:
  const std::stop_token& stop_;
};

/// Colours of the vertices that went into one.
struct ColorSum {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 1;

  VertexColor mean() const {
    VertexColor mean;
    for (std::size_t c = 0; c < mean.size(); ++c) {
      mean[c] = static_cast<std::uint8_t>(std::lround(sum[static_cast<Eigen::Index>(c)] / count));
    }
    return mean;
  }
};
using ColorProperty = OpenMesh::VPropHandleT<ColorSum>;

/// Adds a vertex's colours to those of the vertex that it collapses into.
template <class Mesh>
class ColorAdder : public OpenMesh::Decimater::ModBaseT<Mesh> {
 public:
  using Base = OpenMesh::Decimater::ModBaseT<Mesh>;
  using Handle = OpenMesh::Decimater::ModHandleT<ColorAdder>;
  explicit ColorAdder(Mesh& mesh) : Base(mesh, true) {}

  void add_to(const ColorProperty& sums) { sums_ = sums; }
  void postprocess_collapse(const typename Base::CollapseInfo& collapse) override {
    ColorSum& kept = Base::mesh().property(sums_, collapse.v1);
    const ColorSum& gone = Base::mesh().property(sums_, collapse.v0);
    kept.sum += gone.sum;
    kept.count += gone.count;
  }

 private:
  ColorProperty sums_;
};

/// The colours of `mesh` as a property of its half-edge mesh.
ColorProperty add_colors(const TriangleMesh& mesh, HalfEdgeMesh& half_edges) {
  ColorProperty sums;
  half_edges.add_property(sums);
  for (std::size_t v = 0; v < mesh.colors.size(); ++v) {
    const auto& [red, green, blue] = mesh.colors[v];
    half_edges.property(sums, OpenMesh::VertexHandle(static_cast<int>(v))).sum = {
        double(red), double(green), double(blue)};
  }
  return sums;
}

HalfEdgeMesh half_edges_of(const TriangleMesh& mesh, const std::stop_token& stop) {
  HalfEdgeMesh result;
  result.reserve(mesh.vertices.size(), 3 * mesh.triangles.size() / 2, mesh.triangles.size());
  for (const Eigen::Vector3d& x : mesh.vertices) result.add_vertex({x.x(), x.y(), x.z()});
  // It reports what it refuses on a standard stream; a library must not.
  static std::once_flag is_silent;
  std::call_once(is_silent, [] { omerr().disable(); });
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (t % kCollapsesPolled == 0) throw_if_stopped(stop);
    const auto corner = [&](std::size_t i) {
      return OpenMesh::VertexHandle(static_cast<int>(mesh.triangles[t][i]));
    };
    if (result.add_face(corner(0), corner(1), corner(2)).is_valid()) continue;
    throw InputError(
        fmt::format("triangle {} shares an edge with more than one other, or is wound against it: "
                    "only a manifold mesh can be decimated",
                    t));
  }
  return result;
}

/// Area-weighted means of the triangles around each vertex, of length 1.
std::vector<Eigen::Vector3f> normals_of(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3d> sums(mesh.vertices.size(), Eigen::Vector3d::Zero());
  for (const Triangle& triangle : mesh.triangles) {
    const Eigen::Vector3d& x = mesh.vertices[triangle[0]];
    const Eigen::Vector3d area =
        (mesh.vertices[triangle[1]] - x).cross(mesh.vertices[triangle[2]] - x);
    for (const std::uint32_t corner : triangle) sums[corner] += area;
  }
  std::vector<Eigen::Vector3f> normals;
  normals.reserve(sums.size());
  for (const Eigen::Vector3d& sum : sums) normals.emplace_back(sum.normalized().cast<float>());
  return normals;
}

/// The faces that are left, and the vertices that they have, in the order in which they were.
TriangleMesh collected(HalfEdgeMesh& mesh) {
  mesh.garbage_collection();
  TriangleMesh result;
  for (const auto vertex : mesh.vertices()) {
    const OpenMesh::Vec3d& x = mesh.point(vertex);
    result.vertices.emplace_back(x[0], x[1], x[2]);
  }
  for (const auto face : mesh.faces()) {
    Triangle corners{};
    std::size_t i = 0;
    for (const auto vertex : mesh.fv_range(face)) {
      corners[i++] = static_cast<std::uint32_t>(vertex.idx());
    }
    result.triangles.push_back(corners);
  }
  return result;
}

}  // namespace

TriangleMesh decimated(TriangleMesh mesh, std::size_t most, const std::stop_token& stop) {
  mesh.validate();
  if (mesh.triangles.size() <= most) return mesh;
  HalfEdgeMesh half_edges = half_edges_of(mesh, stop);
  const bool has_normals = !mesh.normals.empty();
  std::optional<ColorProperty> colors;
  if (!mesh.colors.empty()) colors = add_colors(mesh, half_edges);
  mesh = {};
  half_edges.request_face_normals();  // what flipping is judged by
  half_edges.update_face_normals();

  Decimater decimater(half_edges);
  OpenMesh::Decimater::ModQuadricT<HalfEdgeMesh>::Handle harm;
  decimater.add(harm);
  decimater.module(harm).unset_max_err();  // it ranks collapses and forbids none
  OpenMesh::Decimater::ModNormalFlippingT<HalfEdgeMesh>::Handle folds;
  decimater.add(folds);
  ColorAdder<HalfEdgeMesh>::Handle adder;
  if (colors) {
    decimater.add(adder);
    decimater.module(adder).add_to(*colors);
  }
  StopObserver observer(stop);
  decimater.set_observer(&observer);
  decimater.initialize();
  decimater.decimate_to_faces(0, most);
  throw_if_stopped(stop);

  TriangleMesh result = collected(half_edges);
  if (has_normals) result.normals = normals_of(result);
  if (colors) {
    for (const auto vertex : half_edges.vertices()) {
      result.colors.push_back(half_edges.property(*colors, vertex).mean());
    }
  }
  return result;
}

}  // namespace qjulia
