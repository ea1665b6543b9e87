#include "mesh/bvh.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

#include "layout/bvh.h"
#include "mesh/flat_triangle.hpp"
#include "qjulia/base/progress.hpp"

namespace qjulia::shape {
namespace {

using Bounds = Eigen::AlignedBox3d;

constexpr std::size_t kLeafTriangles = 4;
constexpr int kBins = 16;
/// Splits by the heuristic end here; halving takes at most 27 more levels for 2^29 triangles.
constexpr int kHeuristicDepth = 32;
static_assert(kHeuristicDepth + 27 < QJ_BVH_LEVELS);

double half_area(const Bounds& box) {
  if (box.isEmpty()) return 0;
  const Eigen::Vector3d s = box.sizes();
  return s.x() * s.y() + s.y() * s.z() + s.z() * s.x();
}

class Builder {
 public:
  Builder(const TriangleMesh& mesh, double accuracy, std::stop_token stop, Bvh& bvh)
      : mesh_(mesh), accuracy_(accuracy), stop_(std::move(stop)), bvh_(bvh), order_(bvh.order) {
    order_.resize(mesh.triangles.size());
    std::iota(order_.begin(), order_.end(), 0U);
    for (const auto& triangle : mesh.triangles) {
      Bounds box;
      for (const auto v : triangle) box.extend(mesh.vertices[v]);
      boxes_.push_back(box);
    }
  }

  void build() {
    add_nodes(1);
    link(0, QJ_NODE_NEXT) = QJ_NODE_NONE;
    split(0, 0, order_.size(), 0);
    for (const auto t : order_) add_triangle(mesh_.triangles[t]);
  }

 private:
  std::int32_t& link(std::size_t node, std::size_t which) {
    return bvh_.links[node * QJ_NODE_INTS + which];
  }

  std::size_t add_nodes(std::size_t count) {
    const std::size_t first = bvh_.links.size() / QJ_NODE_INTS;
    bvh_.links.resize(bvh_.links.size() + count * QJ_NODE_INTS);
    bvh_.nodes.resize(bvh_.nodes.size() + count * QJ_NODE_REALS);
    return first;
  }

  void split(std::size_t node, std::size_t first, std::size_t last, int depth) {
    // Smaller parts take no time to speak of.
    constexpr std::size_t kSmallPart = std::size_t{1} << 14;
    if (last - first > kSmallPart) throw_if_stopped(stop_);
    set_node(node, first, last);
    const std::size_t middle =
        last - first <= kLeafTriangles ? first : partition(first, last, depth);
    const bool is_leaf = middle == first;
    const std::size_t children = is_leaf ? first : add_nodes(2);
    link(node, QJ_NODE_FIRST) = static_cast<std::int32_t>(children);
    link(node, QJ_NODE_COUNT) = static_cast<std::int32_t>(is_leaf ? last - first : 0);
    if (is_leaf) return;
    for (const auto child : {children, children + 1}) {
      link(child, QJ_NODE_PARENT) = static_cast<std::int32_t>(node);
    }
    link(children, QJ_NODE_NEXT) = static_cast<std::int32_t>(children + 1);
    link(children + 1, QJ_NODE_NEXT) = link(node, QJ_NODE_NEXT);
    split(children, first, middle, depth + 1);
    split(children + 1, middle, last, depth + 1);
  }

  /// Orders the triangles [first, last) so that a left child gets those before the result.
  std::size_t partition(std::size_t first, std::size_t last, int depth) {
    Bounds centers;
    for (std::size_t i = first; i < last; ++i) centers.extend(boxes_[order_[i]].center());
    Eigen::Index axis = 0;
    const double extent = centers.sizes().maxCoeff(&axis);
    const auto begin = order_.begin() + static_cast<std::ptrdiff_t>(first);
    const auto end = order_.begin() + static_cast<std::ptrdiff_t>(last);
    const auto place = [&](std::uint32_t t) { return boxes_[t].center()[axis]; };

    int best_bin = -1;
    const auto bin_of = [&](std::uint32_t t) {
      return std::min(kBins - 1,
                      static_cast<int>(kBins * ((place(t) - centers.min()[axis]) / extent)));
    };
    if (extent > 0 && depth < kHeuristicDepth) {
      std::array<Bounds, kBins> bins;
      std::array<std::size_t, kBins> counts{};
      for (auto it = begin; it != end; ++it) {
        const auto bin = static_cast<std::size_t>(bin_of(*it));
        bins[bin].extend(boxes_[*it]);
        ++counts[bin];
      }
      std::array<double, kBins> right_cost{};
      Bounds box;
      std::size_t count = 0;
      for (std::size_t bin = kBins - 1; bin > 0; --bin) {
        box.extend(bins[bin]);
        count += counts[bin];
        right_cost[bin] = half_area(box) * static_cast<double>(count);
      }
      double best = std::numeric_limits<double>::infinity();
      box.setEmpty();
      count = 0;
      for (std::size_t bin = 0; bin + 1 < kBins; ++bin) {
        box.extend(bins[bin]);
        count += counts[bin];
        const double cost = half_area(box) * static_cast<double>(count) + right_cost[bin + 1];
        if (count > 0 && count < last - first && cost < best) {
          best = cost;
          best_bin = static_cast<int>(bin);
        }
      }
    }
    if (best_bin < 0) {
      const std::size_t middle = first + (last - first) / 2;
      std::nth_element(begin, order_.begin() + static_cast<std::ptrdiff_t>(middle), end,
                       [&](std::uint32_t a, std::uint32_t b) {
                         return std::pair(place(a), a) < std::pair(place(b), b);
                       });
      return middle;
    }
    const auto middle =
        std::stable_partition(begin, end, [&](std::uint32_t t) { return bin_of(t) <= best_bin; });
    return static_cast<std::size_t>(middle - order_.begin());
  }

  void set_node(std::size_t node, std::size_t first, std::size_t last) {
    Bounds box;
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
    double area = 0;
    for (std::size_t i = first; i < last; ++i) {
      const auto& [a, b, c] = mesh_.triangles[order_[i]];
      const auto& x = mesh_.vertices;
      const Eigen::Vector3d n = 0.5 * (x[b] - x[a]).cross(x[c] - x[a]);
      box.extend(boxes_[order_[i]]);
      normal += n;
      centroid += n.norm() * (x[a] + x[b] + x[c]) / 3;
      area += n.norm();
    }
    centroid = area > 0 ? Eigen::Vector3d(centroid / area) : box.center();
    // The corner of the box farthest from the centroid bounds the radius.
    const double radius =
        (box.max() - centroid).cwiseAbs().cwiseMax((box.min() - centroid).cwiseAbs()).norm();
    double* reals = bvh_.nodes.data() + node * QJ_NODE_REALS;
    Eigen::Map<Eigen::Vector3d>(reals + QJ_NODE_LOW) = box.min();
    Eigen::Map<Eigen::Vector3d>(reals + QJ_NODE_HIGH) = box.max();
    Eigen::Map<Eigen::Vector3d>(reals + QJ_NODE_CENTROID) = centroid;
    Eigen::Map<Eigen::Vector3d>(reals + QJ_NODE_NORMAL) = normal;
    reals[QJ_NODE_FAR] = accuracy_ * accuracy_ * radius * radius;
  }

  void add_triangle(const Triangle& triangle) {
    const std::size_t start = bvh_.triangles.size();
    bvh_.triangles.resize(start + QJ_TRIANGLE_REALS);
    const auto& [a, b, c] = triangle;
    flatten(mesh_.vertices[a], mesh_.vertices[b], mesh_.vertices[c], bvh_.triangles.data() + start);
  }

  const TriangleMesh& mesh_;
  double accuracy_;
  std::stop_token stop_;
  Bvh& bvh_;
  std::vector<std::uint32_t>& order_;  ///< triangles, as the leaves will have them
  std::vector<Bounds> boxes_;          ///< one for each triangle
};

}  // namespace

Bvh::Bvh(const TriangleMesh& mesh, double accuracy, std::stop_token stop) {
  Builder(mesh, accuracy, std::move(stop), *this).build();
}

}  // namespace qjulia::shape
