// Balls are found by shrinking (Ma, Bae and Choi 2012, "3D medial axis point approximation using
// nearest neighbors and the normal field"): a ball that touches the surface at p, with its centre
// on the inner normal, shrinks until it also touches the surface where it overlapped it.
//
// Triangles whose normals differ little stand for a round surface. A ball that touches one of them
// near its edge would overlap the next one, however fine the mesh is. So a ball stops shrinking
// when the point that it overlaps is less than 40 degrees from p, as seen from the ball's centre:
// both then belong to the same wall (Ma et al. call this the separation angle). The radius reported
// is the distance from the centre to the mesh, so that the ball lies inside, to within 0.2 %.

#include "print/walls.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "mesh/surface_samples.hpp"
#include "mesh/triangle_tree.hpp"
#include "qjulia/base/progress.hpp"
#include "qjulia/surface/figures.hpp"

namespace qjulia::surface {
namespace {

/// Neighbouring triangles whose normals differ by more meet in a crease; others stand for a round
/// surface.
constexpr double kCrease = 40 * std::numbers::pi / 180;
constexpr double kSlack = 1e-3;  ///< times a ball's radius
constexpr int kMostSteps = 100;  ///< that shrink a ball; each squares the error, so a few will do
/// Hits nearer to a ray's origin than this share of the box's diagonal are rounding errors.
constexpr double kNearestHit = 1e-9;

using shape::TrianglePoint;
using shape::TriangleTree;

/// Normals of the round surface that the triangles at the sampled points stand for.
class RoundNormals {
 public:
  RoundNormals(const TriangleMesh& mesh, const std::vector<TrianglePoint>& points,
               const std::stop_token& stop)
      : mesh_(mesh), slots_(mesh.vertices.size(), kNone) {
    for (const TrianglePoint& point : points) {
      for (const auto v : mesh.triangles[point.triangle]) {
        if (slots_[v] != kNone) continue;
        slots_[v] = static_cast<std::uint32_t>(around_.size());
        around_.emplace_back();
      }
    }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      constexpr std::size_t kPolled = std::size_t{1} << 16;
      if (t % kPolled == 0) throw_if_stopped(stop);
      for (const auto v : mesh.triangles[t]) {
        if (slots_[v] != kNone) around_[slots_[v]].push_back(t);
      }
    }
  }

  /// The mean of the normals at the corners, by barycentric weights (Boubekeur and Alexa 2008,
  /// "Phong tessellation").
  Eigen::Vector3d at(const TrianglePoint& point) const {
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const double weight = point.weights[static_cast<Eigen::Index>(corner)];
      normal += weight * at_corner(point.triangle, mesh_.triangles[point.triangle][corner]);
    }
    return normal.normalized();
  }

 private:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  /// The mean normal of the triangles around vertex `v` of triangle `t`, weighted by their angles
  /// there. Triangles beyond a crease are left out.
  Eigen::Vector3d at_corner(std::size_t t, std::uint32_t v) const {
    const Eigen::Vector3d own = normal_of(t);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const std::size_t other : around_[slots_[v]]) {
      const Eigen::Vector3d normal = normal_of(other);
      if (normal.dot(own) >= std::cos(kCrease)) sum += angle_at(other, v) * normal;
    }
    return sum.normalized();
  }

  Eigen::Vector3d normal_of(std::size_t t) const {
    const auto& [a, b, c] = mesh_.triangles[t];
    const auto& x = mesh_.vertices;
    return (x[b] - x[a]).cross(x[c] - x[a]).normalized();
  }

  double angle_at(std::size_t t, std::uint32_t v) const {
    Triangle triangle = mesh_.triangles[t];
    std::rotate(triangle.begin(), std::ranges::find(triangle, v), triangle.end());
    const auto& x = mesh_.vertices;
    const Eigen::Vector3d one = x[triangle[1]] - x[v], other = x[triangle[2]] - x[v];
    return std::atan2(one.cross(other).norm(), one.dot(other));
  }

  const TriangleMesh& mesh_;
  std::vector<std::uint32_t> slots_;              ///< by vertex: its place in `around_`, or none
  std::vector<std::vector<std::size_t>> around_;  ///< per entry of `slots_`: its vertex's triangles
};

/// The radius of the ball in the wall at `p`, where `inward` is normal to the round surface.
double ball_radius(const TriangleTree& tree, double diagonal, const Eigen::Vector3d& p,
                   const Eigen::Vector3d& inward) {
  // It cannot reach beyond the other side of the wall.
  double radius = 0.5 * std::min(diagonal, tree.first_hit(p, inward, kNearestHit * diagonal));
  for (int step = 1;; ++step) {
    const Eigen::Vector3d center = p + radius * inward;
    const TriangleTree::Nearest found = tree.nearest(center, kSlack);
    const double cosine = (center - found.position).dot(inward) / found.distance;
    if (found.distance >= (1 - kSlack) * radius || cosine > std::cos(kCrease) ||
        step == kMostSteps) {
      return std::min(radius, found.distance);
    }
    // The ball that touches the surface at both points.
    const Eigen::Vector3d to_found = found.position - p;
    radius = to_found.squaredNorm() / (2 * to_found.dot(inward));
  }
}

}  // namespace

std::vector<WallSample> sample_walls(const TriangleMesh& mesh, std::size_t count,
                                     std::uint64_t seed, const std::stop_token& stop) {
  const std::vector<TrianglePoint> points = shape::sample_triangles(mesh, count, seed);
  const RoundNormals normals(mesh, points, stop);
  const TriangleTree tree(mesh, stop);
  const double diagonal = mesh.box().diagonal();
  std::vector<WallSample> samples;
  samples.reserve(count);
  for (const TrianglePoint& point : points) {
    throw_if_stopped(stop);
    const Eigen::Vector3d p = point.position(mesh);
    samples.push_back({p, 2 * ball_radius(tree, diagonal, p, -normals.at(point))});
  }
  return samples;
}

}  // namespace qjulia::surface

namespace qjulia {

WallThickness wall_thickness(const TriangleMesh& mesh, const std::stop_token& stop) {
  constexpr std::size_t kSamples = 4000;
  constexpr std::uint64_t kSeed = 1;
  auto samples = surface::sample_walls(oriented_outward(mesh, stop), kSamples, kSeed, stop);
  std::ranges::sort(samples, {}, &surface::WallSample::thickness);
  const auto at = [&](double part) {
    return samples[static_cast<std::size_t>(part * (kSamples - 1))].thickness;
  };
  return {at(0.01), at(0.1), at(0.5)};
}

}  // namespace qjulia
