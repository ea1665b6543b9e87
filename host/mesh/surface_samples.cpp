#include "mesh/surface_samples.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "base/random.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/mesh/shape.hpp"

namespace qjulia {
namespace {

/// The outward normal of a triangle, with twice the triangle's area as its length.
Eigen::Vector3d area_vector(const TriangleMesh& mesh, const Triangle& triangle) {
  const auto& x = mesh.vertices;
  const auto& [a, b, c] = triangle;
  return (x[b] - x[a]).cross(x[c] - x[a]);
}

}  // namespace

std::vector<shape::TrianglePoint> shape::sample_triangles(const TriangleMesh& mesh,
                                                          std::size_t count, std::uint64_t seed) {
  std::vector<double> area_up_to;  // of all triangles up to each, itself included
  area_up_to.reserve(mesh.triangles.size());
  double area = 0;
  for (const Triangle& triangle : mesh.triangles) {
    area += area_vector(mesh, triangle).norm();
    area_up_to.push_back(area);
  }
  if (!(area > 0)) throw InputError("the mesh has no area to sample; give a mesh with triangles");

  base::Random random(seed);
  std::vector<TrianglePoint> points;
  points.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto found = std::ranges::upper_bound(area_up_to, random.uniform() * area);
    const auto t =
        static_cast<std::size_t>(std::min(found, area_up_to.end() - 1) - area_up_to.begin());
    // Uniform barycentric coordinates (Osada et al. 2002).
    const double r = std::sqrt(random.uniform());
    const double s = random.uniform();
    points.push_back({t, {1 - r, r * (1 - s), r * s}});
  }
  return points;
}

std::vector<SurfacePoint> sample_surface(const TriangleMesh& mesh, std::size_t count,
                                         std::uint64_t seed) {
  mesh.validate();
  std::vector<SurfacePoint> points;
  points.reserve(count);
  for (const shape::TrianglePoint& point : shape::sample_triangles(mesh, count, seed)) {
    points.push_back(
        {point.position(mesh), area_vector(mesh, mesh.triangles[point.triangle]).normalized()});
  }
  return points;
}

}  // namespace qjulia
