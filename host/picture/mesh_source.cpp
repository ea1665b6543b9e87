#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>
#include <vector>

#include "layout/picture_layout.h"
#include "picture/depth_grid.hpp"
#include "picture/depth_source.hpp"
#include "picture/framing.hpp"
#include "qjulia/base/progress.hpp"

namespace qjulia::picture {
namespace {

using Eigen::Vector3d;

/// A z-buffer. With p = eye + s (dir + x dir_dx + y dir_dy) in a perspective view, (s, s x, s y)
/// is linear in p; with p = eye + s dir + x eye_dx + y eye_dy in a parallel one, (s, x, y) is.
class MeshSource : public DepthSource {
 public:
  MeshSource(TriangleMesh mesh, const std::optional<Box>& framed)
      : mesh_(std::move(mesh)), framed_(framed) {}

  std::vector<float> depths(const View& view, int first_row, int rows) override {
    const bool parallel = view.dir_dx.isZero(0);
    Eigen::Matrix3d columns;
    if (parallel) {
      columns << view.dir, view.eye_dx, view.eye_dy;
    } else {
      columns << view.dir, view.dir_dx, view.dir_dy;
    }
    const Eigen::Matrix3d inverse = columns.inverse();
    // (1/s or s, x, y): the first is linear over the picture in either kind of view.
    std::vector<Vector3d> seen(mesh_.vertices.size());
    std::ranges::transform(mesh_.vertices, seen.begin(), [&](const Vector3d& p) -> Vector3d {
      Vector3d v = inverse * (p - view.eye);
      if (parallel) return v;
      return {1 / v[0], v[1] / v[0], v[2] / v[0]};
    });

    std::vector<double> nearest(index(0, rows, view.columns), kFar);
    std::size_t drawn = 0;
    for (const Triangle& triangle : mesh_.triangles) {
      if (drawn++ % kPolled == 0) throw_if_stopped(stop_);
      const Vector3d &a = seen[triangle[0]], &b = seen[triangle[1]], &c = seen[triangle[2]];
      if (parallel || std::min({a[0], b[0], c[0]}) > 0) {
        rasterise(a, b, c, view, parallel, first_row, rows, nearest);
        continue;
      }
      // Some of it is behind the eye, which stands within the mesh.
      std::array<Vector3d, 3> corners;
      std::ranges::transform(triangle, corners.begin(), [&](std::uint32_t v) -> Vector3d {
        return inverse * (mesh_.vertices[v] - view.eye);
      });
      const std::vector<Vector3d> kept = before_eye(corners);
      for (std::size_t i = 2; i < kept.size(); ++i) {
        rasterise(kept[0], kept[i - 1], kept[i], view, parallel, first_row, rows, nearest);
      }
    }
    std::vector<float> depths(nearest.size());
    std::ranges::transform(nearest, depths.begin(), [](double d) {
      return d == kFar ? static_cast<float>(QJ_NO_HIT) : static_cast<float>(d);
    });
    return depths;
  }

  void stop_with(const std::stop_token& stop) override { stop_ = stop; }

  Box bounds() const override { return mesh_.box(); }

  std::vector<Vector3d> outline() override {
    if (!framed_) return extremes(mesh_.vertices, stop_);
    const double rounding = 1e-6 * framed_->diagonal();
    std::vector<Vector3d> within;
    std::ranges::copy_if(mesh_.vertices, std::back_inserter(within), [&](const Vector3d& p) {
      return (p.array() > framed_->low.array() - rounding).all() &&
             (p.array() < framed_->high.array() + rounding).all();
    });
    // Large triangles may have no corner in the box.
    const Box box{framed_->low.array() - rounding, framed_->high.array() + rounding};
    const bool is_whole = within.size() == mesh_.vertices.size();
    for (std::size_t i = 0; !is_whole && i < mesh_.triangles.size(); ++i) {
      if (i % kPolled == 0) throw_if_stopped(stop_);
      const std::vector<Vector3d> part = part_within(box, mesh_.triangles[i]);
      within.insert(within.end(), part.begin(), part.end());
    }
    return extremes(within, stop_);
  }

 private:
  static constexpr double kFar = 1e300;
  static constexpr std::size_t kPolled = std::size_t{1} << 16;  // triangles between two polls

  /// The corners of what lies in a box of a triangle that reaches across the box's sides.
  std::vector<Vector3d> part_within(const Box& box, const Triangle& triangle) const {
    Eigen::AlignedBox3d around;
    for (const std::uint32_t v : triangle) around.extend(mesh_.vertices[v]);
    const bool is_beside = (around.min().array() > box.high.array()).any() ||
                           (around.max().array() < box.low.array()).any();
    const bool is_within = (around.min().array() >= box.low.array()).all() &&
                           (around.max().array() <= box.high.array()).all();
    if (is_beside || is_within) return {};
    std::vector<Vector3d> polygon;
    for (const std::uint32_t v : triangle) polygon.push_back(mesh_.vertices[v]);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      for (const double sign : {-1.0, 1.0}) {
        const double most = sign > 0 ? box.high[axis] : -box.low[axis];
        std::vector<Vector3d> kept;
        for (std::size_t i = 0; i < polygon.size(); ++i) {
          const Vector3d &from = polygon[i], &to = polygon[(i + 1) % polygon.size()];
          const double a = sign * from[axis] - most, b = sign * to[axis] - most;
          if (a <= 0) kept.push_back(from);
          if ((a <= 0) != (b <= 0)) kept.emplace_back(from + a / (a - b) * (to - from));
        }
        polygon = std::move(kept);
      }
    }
    return polygon;
  }

  /// (1/s, x, y) of the polygon that is left of a triangle before the eye, given s (1, x, y).
  static std::vector<Vector3d> before_eye(const std::array<Vector3d, 3>& corners) {
    constexpr double kNear = 1e-6;
    std::vector<Vector3d> kept;
    const auto add = [&](const Vector3d& v) {
      kept.emplace_back(1 / v[0], v[1] / v[0], v[2] / v[0]);
    };
    for (std::size_t i = 0; i < 3; ++i) {
      const Vector3d &from = corners[i], &to = corners[(i + 1) % 3];
      if (from[0] >= kNear) add(from);
      if ((from[0] >= kNear) != (to[0] >= kNear)) {
        add(from + (kNear - from[0]) / (to[0] - from[0]) * (to - from));
      }
    }
    return kept;
  }

  static void rasterise(const Vector3d& a, const Vector3d& b, const Vector3d& c, const View& view,
                        bool parallel, int first_row, int rows, std::vector<double>& nearest) {
    const double area = (b[1] - a[1]) * (c[2] - a[2]) - (c[1] - a[1]) * (b[2] - a[2]);
    if (area == 0 || !std::isfinite(area)) return;
    // Pixel centres at halves.
    const auto range = [](double low, double high, int limit) {
      return std::pair{static_cast<int>(std::clamp(std::ceil(low - 0.5), 0.0, double(limit))),
                       static_cast<int>(std::clamp(std::floor(high - 0.5), -1.0, limit - 1.0))};
    };
    const auto [x0, x1] =
        range(std::min({a[1], b[1], c[1]}), std::max({a[1], b[1], c[1]}), view.columns);
    const auto [y0, y1] = range(std::min({a[2], b[2], c[2]}) - first_row,
                                std::max({a[2], b[2], c[2]}) - first_row, rows);
    for (int j = y0; j <= y1; ++j) {
      for (int i = x0; i <= x1; ++i) {
        const double x = i + 0.5, y = first_row + j + 0.5;
        const double u = ((x - a[1]) * (c[2] - a[2]) - (c[1] - a[1]) * (y - a[2])) / area;
        const double v = ((b[1] - a[1]) * (y - a[2]) - (x - a[1]) * (b[2] - a[2])) / area;
        if (u < 0 || v < 0 || u + v > 1) continue;
        const double s = a[0] + u * (b[0] - a[0]) + v * (c[0] - a[0]);
        const double depth = parallel ? s : view.direction(x, y).norm() / s;
        double& held = nearest[index(i, j, view.columns)];
        held = std::min(held, depth);
      }
    }
  }

  TriangleMesh mesh_;
  std::optional<Box> framed_;
  std::stop_token stop_;
};

}  // namespace

std::unique_ptr<DepthSource> mesh_source(TriangleMesh mesh, const ShapeToMap& to_scene,
                                         const std::optional<Box>& framed) {
  for (Vector3d& vertex : mesh.vertices) vertex = to_scene.to_map(vertex);
  return std::make_unique<MeshSource>(
      std::move(mesh), framed ? std::optional(to_scene.to_map(*framed)) : std::nullopt);
}

}  // namespace qjulia::picture
