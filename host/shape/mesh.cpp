#include "qjulia/mesh.hpp"

#include <Eigen/Geometry>

namespace qjulia {

Box TriangleMesh::box() const {
  if (vertices.empty()) return {};
  Eigen::AlignedBox3d bounds;
  for (const auto& x : vertices) bounds.extend(x);
  return {bounds.min(), bounds.max()};
}

double signed_volume(const TriangleMesh& mesh) {
  const auto& x = mesh.vertices;
  const Eigen::Vector3d origin = mesh.box().center();
  Eigen::Vector3d weighted = Eigen::Vector3d::Zero();
  Eigen::Vector3d normals = Eigen::Vector3d::Zero();
  double area = 0;
  double volume = 0;
  for (const auto& [i, j, k] : mesh.triangles) {
    const Eigen::Vector3d a = x[i] - origin;
    const Eigen::Vector3d b = x[j] - origin;
    const Eigen::Vector3d c = x[k] - origin;
    const Eigen::Vector3d n = 0.5 * (b - a).cross(c - a);
    normals += n;
    weighted += n.norm() * (a + b + c) / 3;
    area += n.norm();
    volume += n.dot(a) / 3;
  }
  if (area <= 0) return 0;
  // Moving the apex of the cones by m changes their volume by -m . sum of n / 3.
  return volume - normals.dot(weighted / area) / 3;
}

TriangleMesh turned_outward(TriangleMesh mesh) {
  if (signed_volume(mesh) < 0) {
    for (auto& [a, b, c] : mesh.triangles) std::swap(b, c);
  }
  return mesh;
}

}  // namespace qjulia
