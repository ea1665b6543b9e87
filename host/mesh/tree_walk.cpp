#include "mesh/tree_walk.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "layout/bvh.h"

namespace qjulia::shape {
namespace {

using TreePoint = std::array<double, 3>;

const double* node_at(const Bvh& tree, std::size_t node) {
  return &tree.nodes[node * QJ_NODE_REALS];
}

double squared_box(const double* node, const TreePoint& p) {
  double sum = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const double d = std::max({node[QJ_NODE_LOW + c] - p[c], p[c] - node[QJ_NODE_HIGH + c], 0.0});
    sum += d * d;
  }
  return sum;
}

double tree_dot(const double* a, const double* b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

double squared_segment(const TreePoint& v, const double* e, double inverse) {
  const double t = std::clamp(tree_dot(v.data(), e) * inverse, 0.0, 1.0);
  const TreePoint d{v[0] - t * e[0], v[1] - t * e[1], v[2] - t * e[2]};
  return tree_dot(d.data(), d.data());
}

/// To the plane where the point lies over the triangle, else to an edge: near enough for a count.
double squared_triangle(const double* t, const TreePoint& p) {
  TreePoint v, w, bc;
  const double* const ab = t + QJ_TRIANGLE_AB;
  const double* const ac = t + QJ_TRIANGLE_AC;
  for (std::size_t c = 0; c < 3; ++c) {
    v[c] = p[c] - t[QJ_TRIANGLE_A + c], w[c] = v[c] - ab[c], bc[c] = ac[c] - ab[c];
  }
  const double edges = std::min({squared_segment(v, ab, t[QJ_TRIANGLE_AB2]),
                                 squared_segment(v, ac, t[QJ_TRIANGLE_AC2]),
                                 squared_segment(w, bc.data(), t[QJ_TRIANGLE_BC2])});
  const double* const n = t + QJ_TRIANGLE_NORMAL;
  const auto side = [&](const double* a, const double* b, const TreePoint& from) {
    return from[0] * (a[1] * b[2] - a[2] * b[1]) + from[1] * (a[2] * b[0] - a[0] * b[2]) +
           from[2] * (a[0] * b[1] - a[1] * b[0]);
  };
  const bool is_over = side(n, ab, v) > 0 && side(n, bc.data(), w) > 0 && side(ac, n, v) > 0;
  const double height = tree_dot(v.data(), n);
  return is_over ? height * height : edges;
}

}  // namespace

TreeWalk nearest_walk(const Bvh& tree, std::span<const TreePoint> points) {
  TreeWalk walk;
  std::vector<double> best(points.size(), std::numeric_limits<double>::infinity());
  // Whether any point needs the node, and the sum of squared distances to it.
  const auto look = [&](std::size_t node) {
    ++walk.boxes;
    std::pair<bool, double> found{false, 0};
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double d = squared_box(node_at(tree, node), points[i]);
      found.first = found.first || d < best[i];
      found.second += d;
    }
    return found;
  };
  std::vector<std::size_t> waiting{0};
  bool is_first = true;
  while (!waiting.empty()) {
    std::size_t node = waiting.back();
    waiting.pop_back();
    if (!is_first && !look(node).first) continue;
    is_first = false;
    for (;;) {
      const std::int32_t* const link = &tree.links[node * QJ_NODE_INTS];
      const auto first = static_cast<std::size_t>(link[QJ_NODE_FIRST]);
      const auto count = static_cast<std::size_t>(link[QJ_NODE_COUNT]);
      for (std::size_t t = first; t < first + count; ++t) {
        ++walk.triangles;
        for (std::size_t i = 0; i < points.size(); ++i) {
          best[i] = std::min(best[i],
                             squared_triangle(&tree.triangles[t * QJ_TRIANGLE_REALS], points[i]));
        }
      }
      if (count > 0) break;
      const auto left = look(first), right = look(first + 1);
      if (!left.first && !right.first) break;
      const bool is_left = left.first && !(right.first && right.second <= left.second);
      if (left.first && right.first) waiting.push_back(is_left ? first + 1 : first);
      node = is_left ? first : first + 1;
    }
  }
  return walk;
}

TreeWalk winding_walk(const Bvh& tree, std::span<const TreePoint> points) {
  TreeWalk walk;
  for (std::int32_t n = 0; n != QJ_NODE_NONE;) {
    const auto node = static_cast<std::size_t>(n);
    const double* const reals = node_at(tree, node);
    const std::int32_t* const link = &tree.links[node * QJ_NODE_INTS];
    ++walk.boxes;
    const bool is_far = std::ranges::all_of(points, [&](const TreePoint& p) {
      double square = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        const double d = reals[QJ_NODE_CENTROID + c] - p[c];
        square += d * d;
      }
      return square > reals[QJ_NODE_FAR];
    });
    if (is_far) {
      n = link[QJ_NODE_NEXT];
      continue;
    }
    walk.triangles += link[QJ_NODE_COUNT];
    n = link[QJ_NODE_COUNT] == 0 ? link[QJ_NODE_FIRST] : link[QJ_NODE_NEXT];
  }
  return walk;
}

}  // namespace qjulia::shape
