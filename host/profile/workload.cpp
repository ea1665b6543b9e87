#include "profile/workload.hpp"

#include <cmath>
#include <numbers>

#include "base/random.hpp"

namespace qjulia::profiling {

Workload make_workload(const ProfileOptions& options) {
  base::Random random(options.seed);
  Workload work;
  const auto point = [&](double reach) {
    const double x = random.uniform(-reach, reach), y = random.uniform(-reach, reach);
    return Eigen::Vector3d(x, y, random.uniform(-reach, reach));
  };
  for (std::size_t i = 0; i < options.samples; ++i) {
    work.samples.add(point(1.5), 1 / static_cast<double>(options.samples), 0, 0);
  }
  constexpr double kRoots = 0.57;
  work.map.log_scale = -0.1;
  for (std::size_t k = 0; k < options.factors; ++k) {
    const Eigen::Vector3d c = point(1);
    const double size = random.uniform(0.01, 0.06);
    const bool root = static_cast<double>(k) < kRoots * static_cast<double>(options.factors);
    work.map.factors.push_back({{c.x(), c.y(), c.z(), 0}, root ? size : -size});
  }
  return work;
}

TriangleMesh make_sphere(int rings) {
  TriangleMesh mesh;
  const int around = 2 * rings;
  const auto index = [&](int ring, int step) {
    return static_cast<std::uint32_t>(1 + (ring - 1) * around + step % around);
  };
  mesh.vertices.emplace_back(0, 0, 1);
  for (int ring = 1; ring < rings; ++ring) {
    const double polar = std::numbers::pi * ring / rings;
    for (int step = 0; step < around; ++step) {
      const double azimuth = 2 * std::numbers::pi * step / around;
      mesh.vertices.emplace_back(std::sin(polar) * std::cos(azimuth),
                                 std::sin(polar) * std::sin(azimuth), std::cos(polar));
    }
  }
  const auto south = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.emplace_back(0, 0, -1);
  for (int step = 0; step < around; ++step) {
    mesh.triangles.push_back({0, index(1, step), index(1, step + 1)});
    for (int ring = 1; ring + 1 < rings; ++ring) {
      mesh.triangles.push_back(
          {index(ring, step), index(ring + 1, step), index(ring + 1, step + 1)});
      mesh.triangles.push_back(
          {index(ring, step), index(ring + 1, step + 1), index(ring, step + 1)});
    }
    mesh.triangles.push_back({south, index(rings - 1, step + 1), index(rings - 1, step)});
  }
  return mesh;
}

}  // namespace qjulia::profiling
