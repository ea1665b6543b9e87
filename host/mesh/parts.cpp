#include "mesh/parts.hpp"

#include <limits>

#include "base/union_find.hpp"
#include "qjulia/base/progress.hpp"

namespace qjulia {
namespace shape {

Parts connected_parts(const TriangleMesh& mesh, const std::stop_token& stop) {
  constexpr std::uint32_t kUnnumbered = std::numeric_limits<std::uint32_t>::max();
  const auto& x = mesh.vertices;
  base::UnionFind joined(x.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (t % kTrianglesPolled == 0) throw_if_stopped(stop);
    const auto& [a, b, c] = mesh.triangles[t];
    joined.unite(a, b);
    joined.unite(a, c);
  }
  Parts parts;
  parts.of_triangle.reserve(mesh.triangles.size());
  const Eigen::Vector3d apex = mesh.box().center();
  std::vector<std::uint32_t> number(x.size(), kUnnumbered);  // each root's part
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (t % kTrianglesPolled == 0) throw_if_stopped(stop);
    const auto& [a, b, c] = mesh.triangles[t];
    std::uint32_t& part = number[joined.root(a)];
    if (part == kUnnumbered) {
      part = static_cast<std::uint32_t>(parts.sums.size());
      parts.sums.emplace_back();
    }
    parts.of_triangle.push_back(part);
    parts.sums[part] += ConeSum(x[a] - apex, x[b] - apex, x[c] - apex);
  }
  return parts;
}

double Parts::signed_volume() const {
  double volume = 0;
  ConeSum open;
  for (const ConeSum& part : sums) {
    if (part.is_closed()) {
      volume += part.volume;
    } else {
      open += part;
    }
  }
  return volume + open.volume_from_centroid();
}

}  // namespace shape

double signed_volume(const TriangleMesh& mesh) {
  mesh.validate();
  return shape::connected_parts(mesh).signed_volume();
}

}  // namespace qjulia
