#include <algorithm>
#include <array>

#include "base/random.hpp"
#include "check/checks.hpp"
#include "profile/workload.hpp"
#include "qjulia/mesh/shape.hpp"

namespace qjulia::check {
namespace {

using Eigen::Vector3d;
using profiling::largest_difference;

/// The cube [−1, 1]³ in triangles of which none is larger than a sixteenth of a face.
TriangleMesh cube() {
  constexpr int kSteps = 8;
  TriangleMesh mesh;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      for (int i = 0; i < kSteps; ++i) {
        for (int j = 0; j < kSteps; ++j) {
          const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
          for (const auto& [u, v] : {std::pair{i, j}, {i + 1, j}, {i + 1, j + 1}, {i, j + 1}}) {
            Vector3d at;
            at[axis] = side;
            at[(axis + 1) % 3] = 2.0 * u / kSteps - 1;
            at[(axis + 2) % 3] = side * (2.0 * v / kSteps - 1);
            mesh.vertices.push_back(at);
          }
          mesh.triangles.push_back({first, first + 1, first + 2});
          mesh.triangles.push_back({first, first + 2, first + 3});
        }
      }
    }
  }
  return mesh;
}

double signed_distance(const Device& device, Precision precision) {
  base::Random random(3);
  std::vector<Vector3d> points(500);
  std::vector<double> right;
  for (Vector3d& x : points) {
    for (double& coordinate : x) coordinate = random.uniform(-2, 2);
    const Vector3d beyond = x.cwiseAbs() - Vector3d::Ones();
    right.push_back(beyond.cwiseMax(0).norm() + std::min(beyond.maxCoeff(), 0.0));
  }
  return largest_difference(SignedDistance(device, cube(), precision).at(points), right);
}

constexpr std::array kShapeChecks{
    Check{"signed_distance.cl", "distances from a cube", 1e-5, 1e-12, signed_distance, true},
};

}  // namespace

std::span<const Check> shape_checks() { return kShapeChecks; }

}  // namespace qjulia::check
