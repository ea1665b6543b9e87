#include "mesh/triangle_tree.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "layout/bvh.h"
#include "mesh/flat_triangle.hpp"
#include "qjulia/base/progress.hpp"

namespace qjulia::shape {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// A ray that misses a triangle by less than this share of its size counts as meeting it, so that
/// none slips between two neighbours.
constexpr double kEdgeMargin = 1e-9;

struct HalfLine {
  Eigen::Vector3d origin, direction;
};

/// How far the ray goes before it enters a box, at least 0; infinite if it misses the box.
double box_entry(const HalfLine& ray, const double* node) {
  double enter = 0, leave = kInfinity;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double to_low = node[QJ_NODE_LOW + axis] - ray.origin[axis];
    const double to_high = node[QJ_NODE_HIGH + axis] - ray.origin[axis];
    const double speed = ray.direction[axis];
    if (speed == 0) {
      if (to_low > 0 || to_high < 0) return kInfinity;
      continue;
    }
    const auto [first, second] = std::minmax({to_low / speed, to_high / speed});
    enter = std::max(enter, first);
    leave = std::min(leave, second);
  }
  return enter <= leave * (1 + kEdgeMargin) ? enter : kInfinity;
}

/// How far the ray goes before it meets a triangle (Möller and Trumbore 1997); infinite if it does
/// not.
double triangle_hit(const HalfLine& ray, const double* triangle) {
  const Eigen::Vector3d ab = vector_at(triangle + QJ_TRIANGLE_AB);
  const Eigen::Vector3d ac = vector_at(triangle + QJ_TRIANGLE_AC);
  const Eigen::Vector3d across = ray.direction.cross(ac);
  const double determinant = ab.dot(across);
  if (determinant == 0) return kInfinity;
  const Eigen::Vector3d from_a = ray.origin - vector_at(triangle + QJ_TRIANGLE_A);
  const Eigen::Vector3d turned = from_a.cross(ab);
  const double b = from_a.dot(across) / determinant;
  const double c = ray.direction.dot(turned) / determinant;
  const bool is_met = b >= -kEdgeMargin && c >= -kEdgeMargin && b + c <= 1 + kEdgeMargin;
  return is_met ? ac.dot(turned) / determinant : kInfinity;
}

/// Visits the triangles of leaves whose bound, `bound_of(node)`, is below `best`. `visit(triangle)`
/// may lower `best`. Of two children, the one with the lower bound comes first.
template <class BoundOf, class Visit>
void visit_leaves(const Bvh& bvh, const double& best, const BoundOf& bound_of, const Visit& visit) {
  if (bvh.triangles.empty()) return;
  const auto bounded = [&](std::size_t node) { return std::pair(bound_of(node), node); };
  std::array<std::pair<double, std::size_t>, QJ_BVH_LEVELS> waiting;
  std::size_t count = 0;
  waiting[count++] = bounded(0);
  while (count > 0) {
    const auto [bound, node] = waiting[--count];
    if (!(bound < best)) continue;
    const std::int32_t* link = bvh.links.data() + node * QJ_NODE_INTS;
    const auto first = static_cast<std::size_t>(link[QJ_NODE_FIRST]);
    const auto triangles = static_cast<std::size_t>(link[QJ_NODE_COUNT]);
    for (std::size_t t = first; t < first + triangles; ++t) {
      visit(bvh.triangles.data() + t * QJ_TRIANGLE_REALS);
    }
    if (triangles > 0) continue;
    auto near = bounded(first), far = bounded(first + 1);
    if (far.first < near.first) std::swap(near, far);
    waiting[count++] = far;
    waiting[count++] = near;
  }
}

}  // namespace

TriangleTree::TriangleTree(const TriangleMesh& mesh, std::stop_token stop)
    : bvh_(mesh, /*accuracy=*/1, stop), slabs_(bvh_.links.size() / QJ_NODE_INTS) {
  if (!slabs_.empty()) set_slabs(0, 0, stop);
}

std::size_t TriangleTree::set_slabs(std::size_t node, std::size_t first,
                                    const std::stop_token& stop) {
  const std::int32_t* link = bvh_.links.data() + node * QJ_NODE_INTS;
  const auto below = static_cast<std::size_t>(link[QJ_NODE_FIRST]);
  std::size_t last = first + static_cast<std::size_t>(link[QJ_NODE_COUNT]);
  if (last == first) last = set_slabs(below + 1, set_slabs(below, first, stop), stop);
  // Larger parts are not flat, and there are few of them.
  constexpr std::size_t kMostTriangles = std::size_t{1} << 16;
  Slab& slab = slabs_[node];
  slab = {Eigen::Vector3d::Zero(), 0, 0};
  if (last - first > kMostTriangles) {
    throw_if_stopped(stop);
    return last;
  }
  const double* reals = bvh_.nodes.data() + node * QJ_NODE_REALS;
  slab.normal = vector_at(reals + QJ_NODE_NORMAL).normalized();
  slab.low = kInfinity;
  slab.high = -kInfinity;
  for (std::size_t t = first; t < last; ++t) {
    const double* triangle = bvh_.triangles.data() + t * QJ_TRIANGLE_REALS;
    const double a = slab.normal.dot(vector_at(triangle + QJ_TRIANGLE_A));
    const double b = a + slab.normal.dot(vector_at(triangle + QJ_TRIANGLE_AB));
    const double c = a + slab.normal.dot(vector_at(triangle + QJ_TRIANGLE_AC));
    slab.low = std::min({slab.low, a, b, c});
    slab.high = std::max({slab.high, a, b, c});
  }
  return last;
}

double TriangleTree::squared_bound(const Eigen::Vector3d& p, std::size_t node) const {
  const double* reals = bvh_.nodes.data() + node * QJ_NODE_REALS;
  const Eigen::Vector3d low = vector_at(reals + QJ_NODE_LOW),
                        high = vector_at(reals + QJ_NODE_HIGH);
  const double to_box = (low - p).cwiseMax(p - high).cwiseMax(0.0).squaredNorm();
  const Slab& slab = slabs_[node];
  const double height = slab.normal.dot(p);
  const double to_slab = std::max({slab.low - height, height - slab.high, 0.0});
  return std::max(to_box, to_slab * to_slab);
}

TriangleTree::Nearest TriangleTree::nearest(const Eigen::Vector3d& p, double slack) const {
  const double lengthened = (1 + slack) * (1 + slack);
  Eigen::Vector3d position = p;
  double best = kInfinity;  // squared distance
  const double* of = bvh_.triangles.data();
  visit_leaves(
      bvh_, best, [&](std::size_t node) { return lengthened * squared_bound(p, node); },
      [&](const double* triangle) {
        const Eigen::Vector3d x = nearest_on_triangle(p, triangle);
        const double square = (x - p).squaredNorm();
        if (!(square < best)) return;
        position = x;
        of = triangle;
        best = square;
      });
  const auto place = static_cast<std::size_t>(of - bvh_.triangles.data()) / QJ_TRIANGLE_REALS;
  return {position, std::sqrt(best), bvh_.order.empty() ? 0 : bvh_.order[place]};
}

double TriangleTree::first_hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                               double least) const {
  const HalfLine ray{origin, direction};
  double best = kInfinity;
  visit_leaves(
      bvh_, best,
      [&](std::size_t node) { return box_entry(ray, bvh_.nodes.data() + node * QJ_NODE_REALS); },
      [&](const double* triangle) {
        const double at = triangle_hit(ray, triangle);
        if (at > least) best = std::min(best, at);
      });
  return best;
}

}  // namespace qjulia::shape
