#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "qjulia/mesh.hpp"

namespace qjulia {
namespace {

/// Sets of vertices that triangles join.
class Components {
 public:
  explicit Components(std::size_t vertices) : parent_(vertices) {
    std::iota(parent_.begin(), parent_.end(), 0U);
  }
  std::uint32_t root(std::uint32_t v) {
    while (parent_[v] != v) v = parent_[v] = parent_[parent_[v]];
    return v;
  }
  void join(std::uint32_t a, std::uint32_t b) { parent_[root(a)] = root(b); }

 private:
  std::vector<std::uint32_t> parent_;
};

std::size_t count_components(const TriangleMesh& mesh) {
  Components components(mesh.vertices.size());
  std::vector<bool> used(mesh.vertices.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    components.join(a, b);
    components.join(b, c);
    used[a] = used[b] = used[c] = true;
  }
  std::size_t count = 0;
  for (std::uint32_t v = 0; v < used.size(); ++v) {
    if (used[v] && components.root(v) == v) ++count;
  }
  return count;
}

void count_edges(const TriangleMesh& mesh, MeshReport& report) {
  struct Edge {
    std::uint64_t ends;  // the lower vertex in the upper half
    bool upward;         // from the lower vertex to the higher
  };
  std::vector<Edge> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    for (const auto& [from, to] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)}) {
      const auto [low, high] = std::minmax(from, to);
      edges.push_back({std::uint64_t{low} << 32 | high, from < to});
    }
  }
  std::ranges::sort(edges, {}, &Edge::ends);
  for (auto edge = edges.begin(); edge != edges.end();) {
    const auto next = std::find_if(edge, edges.end(),
                                   [&](const Edge& other) { return other.ends != edge->ends; });
    const auto uses = next - edge;
    if (uses == 1) {
      ++report.open_edges;
    } else if (uses > 2 || edge->upward == (edge + 1)->upward) {
      ++report.non_manifold_edges;
    }
    edge = next;
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

MeshReport inspect(const TriangleMesh& mesh) {
  MeshReport report;
  report.vertices = mesh.vertices.size();
  report.triangles = mesh.triangles.size();
  report.components = count_components(mesh);
  report.is_inside_out = signed_volume(mesh) < 0;
  report.rounding = rounding_of(mesh);
  count_edges(mesh, report);
  return report;
}

std::vector<std::string> MeshReport::warnings() const {
  std::vector<std::string> warnings;
  if (open_edges > 0) {
    warnings.push_back(fmt::format(
        "the mesh has {} open edges: where it has holes, the inside is an estimate", open_edges));
  }
  if (non_manifold_edges > 0) {
    warnings.push_back(
        fmt::format("the mesh has {} edges where more than two triangles meet or two meet with "
                    "opposite sides out",
                    non_manifold_edges));
  }
  if (is_inside_out) warnings.emplace_back("the mesh is inside out: its triangles are turned");
  if (dropped_triangles > 0) {
    warnings.push_back(fmt::format("{} triangles without area are left out", dropped_triangles));
  }
  constexpr double kVisible = 1e-4;
  if (rounding > kVisible) {
    warnings.push_back(
        fmt::format("the mesh is far from the origin: vertices are rounded by up to {:.2g} of its "
                    "size; move it "
                    "near the origin and export it again",
                    rounding));
  }
  return warnings;
}

}  // namespace qjulia
