#include "mesh/triangulate.hpp"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace qjulia::shape {
namespace {

using Point = Eigen::Vector2d;

/// Sign of the sum, without rounding: a nonoverlapping expansion whose largest component has it
/// (Shewchuk 1997, Grow-Expansion).
int sign_of_sum(const std::array<double, 6>& terms) {
  std::array<double, 6> expansion{};
  std::size_t size = 0;
  for (const double term : terms) {
    double sum = term;
    for (std::size_t i = 0; i < size; ++i) {
      const double a = sum;
      const double b = expansion[i];
      sum = a + b;
      const double rounded_b = sum - a;
      expansion[i] = (a - (sum - rounded_b)) + (b - rounded_b);
    }
    expansion[size++] = sum;
  }
  for (std::size_t i = size; i-- > 0;) {
    if (expansion[i] != 0) return expansion[i] > 0 ? 1 : -1;
  }
  return 0;
}

/// 1 where a, b, c turn left, −1 right, 0 in one line; exact, as products of two numbers of single
/// precision are in double precision.
int orientation(const Point& a, const Point& b, const Point& c) {
  const double left = (b.x() - a.x()) * (c.y() - a.y());
  const double right = (b.y() - a.y()) * (c.x() - a.x());
  // Twice Shewchuk's bound.
  const double error =
      8 * std::numeric_limits<double>::epsilon() * (std::abs(left) + std::abs(right));
  if (left - right > error) return 1;
  if (right - left > error) return -1;
  return sign_of_sum({a.x() * b.y(), -a.y() * b.x(), b.x() * c.y(), -b.y() * c.x(), c.x() * a.y(),
                      -c.y() * a.x()});
}

/// The polygon in the coordinate plane that its area vector (Newell) faces most, turning left; none
/// without area.
std::vector<Point> projected(const std::vector<Eigen::Vector3d>& corners) {
  Eigen::Vector3d area = Eigen::Vector3d::Zero();
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
    area += (corners[i] - corners[0]).cross(corners[i + 1] - corners[0]);
  }
  if (area.isZero(0)) return {};
  Eigen::Index axis = 0;
  area.cwiseAbs().maxCoeff(&axis);
  Eigen::Index u = (axis + 1) % 3;
  Eigen::Index v = (axis + 2) % 3;
  if (area[axis] < 0) std::swap(u, v);
  std::vector<Point> points;
  points.reserve(corners.size());
  for (const auto& x : corners) points.emplace_back(x[u], x[v]);
  return points;
}

class EarClipper {
 public:
  EarClipper(const std::vector<Point>& points, const std::function<void()>& poll)
      : points_(points),
        poll_(poll),
        next_(points.size()),
        previous_(points.size()),
        is_reflex_(points.size()) {
    const std::size_t n = points.size();
    for (std::size_t i = 0; i < n; ++i) {
      next_[i] = (i + 1) % n;
      previous_[i] = (i + n - 1) % n;
    }
  }

  /// Places of the corners of n − 2 triangles. @return as `triangulate` does.
  bool clip(std::vector<std::array<std::size_t, 3>>& triangles) {
    std::size_t corner = 0;
    std::size_t left = points_.size();
    // Corners that repeat the one before would never be ears.
    for (std::size_t i = 1; i < points_.size() && left > 3; ++i) {
      if (points_[i] != points_[previous_[i]]) continue;
      triangles.push_back({i, i, i});
      unlink(i);
      --left;
    }
    for (std::size_t i = corner, end = left; end > 0; i = next_[i], --end) {
      is_reflex_[i] = turn(i) <= 0;
      if (is_reflex_[i]) reflex_.push_back(i);
    }
    for (std::size_t failed = 0; left > 3 && failed < left;) {
      if (is_ear(corner)) {
        triangles.push_back({previous_[corner], corner, next_[corner]});
        corner = remove(corner);
        --left;
        failed = 0;
      } else {
        corner = next_[corner];
        ++failed;
      }
    }
    // What is left is one triangle, or has no ear: a fan, as good as any.
    const bool is_whole = left == 3 && turn(corner) >= 0;
    for (std::size_t b = next_[corner]; next_[b] != corner; b = next_[b]) {
      triangles.push_back({corner, b, next_[b]});
    }
    return is_whole;
  }

 private:
  int turn(std::size_t i) const {
    return orientation(points_[previous_[i]], points_[i], points_[next_[i]]);
  }

  /// Whether a triangle at a left turn holds no other corner of the polygon.
  bool is_ear(std::size_t i) {
    if (tests_ > kMostTests || turn(i) <= 0) return false;
    const Point& a = points_[previous_[i]];
    const Point& b = points_[i];
    const Point& c = points_[next_[i]];
    const Point low = a.cwiseMin(b).cwiseMin(c);
    const Point high = a.cwiseMax(b).cwiseMax(c);
    constexpr std::size_t kTestsBetweenPolls = std::size_t{1} << 20;
    for (std::size_t k = 0; k < reflex_.size(); ++k) {
      if (++tests_ % kTestsBetweenPolls == 0) poll_();
      while (k < reflex_.size() && !is_reflex_[reflex_[k]]) {
        reflex_[k] = reflex_.back();
        reflex_.pop_back();
      }
      if (k == reflex_.size()) break;
      const Point& x = points_[reflex_[k]];
      if ((x.array() < low.array()).any() || (x.array() > high.array()).any()) continue;
      if (x == a || x == b || x == c) continue;  // the triangle's own, or the end of a bridge
      if (orientation(a, b, x) >= 0 && orientation(b, c, x) >= 0 && orientation(c, a, x) >= 0) {
        return false;
      }
    }
    return true;
  }

  void unlink(std::size_t i) {
    next_[previous_[i]] = next_[i];
    previous_[next_[i]] = previous_[i];
  }

  /// @return where to look for the next ear: not beside this one, which would make slivers.
  std::size_t remove(std::size_t i) {
    unlink(i);
    is_reflex_[i] = false;
    // Other corners turn left for good once they do.
    for (const std::size_t beside : {previous_[i], next_[i]}) {
      if (is_reflex_[beside] && turn(beside) > 0) is_reflex_[beside] = false;
    }
    return next_[next_[i]];
  }

  static constexpr std::size_t kMostTests = 200'000'000;  ///< about a second

  const std::vector<Point>& points_;
  const std::function<void()>& poll_;
  std::vector<std::size_t> next_;
  std::vector<std::size_t> previous_;
  std::vector<bool> is_reflex_;      ///< does not turn left
  std::vector<std::size_t> reflex_;  ///< those corners, and some that are no longer reflex
  std::size_t tests_ = 0;
};

}  // namespace

bool triangulate(std::span<const Eigen::Vector3d> vertices, std::span<Triangle> fan,
                 const std::function<void()>& poll) {
  std::vector<std::uint32_t> corners = {fan[0][0], fan[0][1]};
  for (const Triangle& triangle : fan) corners.push_back(triangle[2]);
  std::vector<Eigen::Vector3d> positions;
  positions.reserve(corners.size());
  for (const auto v : corners) positions.push_back(vertices[v]);
  const std::vector<Point> points = projected(positions);
  if (points.empty()) return false;

  bool is_covered = true;  // by the fan: seen from its first corner, the others go round it
  for (std::size_t i = 2; i < points.size() && is_covered; ++i) {
    is_covered = orientation(points[0], points[i - 1], points[i]) > 0;
  }
  if (is_covered) return true;

  std::vector<std::array<std::size_t, 3>> triangles;
  triangles.reserve(fan.size());
  const bool is_simple = EarClipper(points, poll).clip(triangles);
  for (std::size_t t = 0; t < fan.size(); ++t) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      fan[t][corner] = corners[triangles[t][corner]];
    }
  }
  return is_simple;
}

}  // namespace qjulia::shape
