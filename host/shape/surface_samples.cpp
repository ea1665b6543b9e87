#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "base/random.hpp"
#include "qjulia/error.hpp"
#include "qjulia/shape.hpp"

namespace qjulia {

std::vector<SurfacePoint> sample_surface(const TriangleMesh& mesh, std::size_t count,
                                         std::uint64_t seed) {
  mesh.validate();
  const auto& x = mesh.vertices;
  std::vector<double> area_up_to;  // of the triangles before and including each
  std::vector<Eigen::Vector3d> normals;
  double area = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    normals.emplace_back((x[b] - x[a]).cross(x[c] - x[a]));
    area += normals.back().norm();
    area_up_to.push_back(area);
    normals.back().normalize();
  }
  if (!(area > 0)) throw InputError("the mesh has no area to sample; give a mesh with triangles");

  base::Random random(seed);
  std::vector<SurfacePoint> points;
  points.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto found = std::ranges::upper_bound(area_up_to, random.uniform() * area);
    const auto t =
        static_cast<std::size_t>(std::min(found, area_up_to.end() - 1) - area_up_to.begin());
    const auto& [a, b, c] = mesh.triangles[t];
    // Uniform barycentric coordinates (Osada et al. 2002).
    const double r = std::sqrt(random.uniform());
    const double s = random.uniform();
    points.push_back({(1 - r) * x[a] + r * (1 - s) * x[b] + r * s * x[c], normals[t]});
  }
  return points;
}

}  // namespace qjulia
