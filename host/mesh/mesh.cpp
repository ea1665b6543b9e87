#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>

#include "mesh/mesh_report.hpp"
#include "mesh/parts.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/base/progress.hpp"

namespace qjulia {
namespace {

/// Triangles or vertices between two polls.
constexpr std::size_t kElementsPolled = std::size_t{1} << 16;

/// Counts edges by their lower vertex first, so that only those at one vertex have to be sorted.
void count_edges(const TriangleMesh& mesh, MeshReport& report, const std::stop_token& stop) {
  struct Edge {
    std::uint32_t high;  // vertex
    bool upward;         // from the lower vertex to the higher
  };
  const auto for_edges = [&](const auto& use) {
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      if (t % kElementsPolled == 0) throw_if_stopped(stop);
      const auto& [a, b, c] = mesh.triangles[t];
      for (const auto& [from, to] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)}) {
        const auto [low, high] = std::minmax(from, to);
        use(low, Edge{high, from < to});
      }
    }
  };
  std::vector<std::size_t> end(mesh.vertices.size() + 1);  // end of the edges of each lower vertex
  for_edges([&](std::uint32_t low, const Edge&) { ++end[low + 1]; });
  std::partial_sum(end.begin(), end.end(), end.begin());
  std::vector<Edge> edges(3 * mesh.triangles.size());
  for_edges([&](std::uint32_t low, const Edge& edge) { edges[end[low]++] = edge; });
  auto edge = edges.begin();
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (v % kElementsPolled == 0) throw_if_stopped(stop);
    const auto last = edges.begin() + static_cast<std::ptrdiff_t>(end[v]);
    std::sort(edge, last, [](const Edge& a, const Edge& b) { return a.high < b.high; });
    while (edge != last) {
      const auto next =
          std::find_if(edge, last, [&](const Edge& other) { return other.high != edge->high; });
      const auto uses = next - edge;
      if (uses == 1) {
        ++report.open_edges;
      } else if (uses > 2 || edge->upward == (edge + 1)->upward) {
        ++report.non_manifold_edges;
      }
      edge = next;
    }
  }
}

/// Single precision's step at the coordinates' size, over the size of the mesh.
double rounding_of(const TriangleMesh& mesh) {
  const Box box = mesh.box();
  const double largest = box.low.cwiseAbs().cwiseMax(box.high.cwiseAbs()).maxCoeff();
  const double side = box.size().maxCoeff();
  return side > 0 ? largest / side * 0x1p-24 : 0;
}

}  // namespace

Box TriangleMesh::box() const {
  if (vertices.empty()) return {};
  Eigen::AlignedBox3d bounds;
  for (const auto& x : vertices) bounds.extend(x);
  return {bounds.min(), bounds.max()};
}

void shape::check_triangles(std::span<const Eigen::Vector3d> vertices,
                            std::span<const Triangle> triangles) {
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    if (vertices[v].allFinite()) continue;
    const auto& x = vertices[v];
    throw InputError(fmt::format("the mesh's vertices[{}] is ({}, {}, {}): give finite numbers", v,
                                 x.x(), x.y(), x.z()));
  }
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const std::uint32_t last = std::ranges::max(triangles[t]);
    if (last < vertices.size()) continue;
    throw InputError(
        fmt::format("the mesh's triangles[{}] has vertex {}, and there are {}, numbered from 0", t,
                    last, vertices.size()));
  }
}

void TriangleMesh::validate() const {
  shape::check_triangles(vertices, triangles);
  if (!colors.empty() && colors.size() != vertices.size()) {
    throw InputError(
        fmt::format("the mesh has {} colours and {} vertices: give one for each vertex, or none",
                    colors.size(), vertices.size()));
  }
  if (normals.empty()) return;
  if (normals.size() != vertices.size()) {
    throw InputError(
        fmt::format("the mesh has {} normals and {} vertices: give one for each vertex, or none",
                    normals.size(), vertices.size()));
  }
  const auto wrong = std::ranges::find_if(normals, [](const auto& n) { return !n.allFinite(); });
  if (wrong == normals.end()) return;
  throw InputError(
      fmt::format("the mesh's normals[{}] is not finite", std::distance(normals.begin(), wrong)));
}

MeshReport shape::inspect(const TriangleMesh& mesh, MeshReport report,
                          const std::stop_token& stop) {
  report.vertices = mesh.vertices.size();
  report.triangles = mesh.triangles.size();
  const Parts parts = connected_parts(mesh, stop);
  const std::vector<bool> turned = parts_inside_out(mesh, parts, stop);
  report.components = parts.size();
  report.turned_parts = static_cast<std::size_t>(std::ranges::count(turned, true));
  report.is_inside_out = report.turned_parts > 0 && report.turned_parts == parts.size();
  report.rounding = rounding_of(mesh);
  count_edges(mesh, report, stop);
  return report;
}

MeshReport inspect(const TriangleMesh& mesh) {
  mesh.validate();
  return shape::inspect(mesh, {}, {});
}

std::string shape::size_problem(const Box& box) {
  // Squares and cubes of these, and their inverses, are finite in single precision.
  constexpr double kLargest = 1e12;
  constexpr double kLeastSide = 1e-12;
  const double largest = box.low.cwiseAbs().cwiseMax(box.high.cwiseAbs()).maxCoeff();
  const double side = box.size().maxCoeff();
  if (!(largest <= kLargest)) {
    return fmt::format("it has coordinates up to {:.3g}; scale the mesh so that none exceeds {:g}",
                       largest, kLargest);
  }
  if (!(side >= kLeastSide)) {
    return fmt::format("its longest side is {:.3g}; scale the mesh so that it is at least {:g}",
                       side, kLeastSide);
  }
  return {};
}

std::vector<std::string> MeshReport::warnings() const {
  std::vector<std::string> warnings;
  const auto warn_where = [&](bool is_so, const std::string& warning) {
    if (is_so) warnings.push_back(warning);
  };
  warn_where(points > 0,
             fmt::format("the file has {} points and no faces: each stands for a small polygon "
                         "across its normal",
                         points));
  warn_where(
      open_edges > 0 && points == 0,
      fmt::format("the mesh has {} open edges: where it has holes, the inside is an estimate",
                  open_edges));
  warn_where(non_manifold_edges > 0,
             fmt::format("the mesh has {} edges where more than two triangles meet or two meet "
                         "with opposite sides out",
                         non_manifold_edges));
  warn_where(is_inside_out, "the mesh is inside out: its triangles are turned");
  warn_where(turned_parts > 0 && !is_inside_out,
             fmt::format("parts of the mesh are inside out ({} of {}): their triangles are turned",
                         turned_parts, components));
  warn_where(dropped_triangles > 0,
             fmt::format("{} triangles without area are left out", dropped_triangles));
  warn_where(bad_polygons > 0,
             fmt::format("{} polygons cross themselves or have no area: they are cut into "
                         "triangles as well as they can be",
                         bad_polygons));
  warn_where(duplicate_triangles > 0,
             fmt::format("{} triangles repeat others and are left out", duplicate_triangles));
  warn_where(is_two_sided,
             "each triangle is there with both windings: of each pair, the first is used");
  warn_where(
      two_sided_triangles > 0 && !is_two_sided,
      fmt::format("{} triangles are there with both windings: they are sheets without an inside",
                  two_sided_triangles));
  constexpr double kVisible = 1e-4;
  warn_where(rounding > kVisible,
             fmt::format("the mesh is far from the origin: vertices are rounded by up to {:.2g} of "
                         "its size; move it near the origin and export it again",
                         rounding));
  return warnings;
}

}  // namespace qjulia
