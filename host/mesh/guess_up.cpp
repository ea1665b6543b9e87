#include <algorithm>
#include <cmath>
#include <utility>

#include "qjulia/mesh/mesh.hpp"

namespace qjulia {
namespace {

/// What counts as an end of the mesh, as a share of its extent.
constexpr double kEnd = 0.02;
/// An end below this is no foot: round bodies have ends of 0.06.
constexpr double kLeastFoot = 0.09;
/// Another end has to be so much better than the default's.
constexpr double kClearly = 1.25;
/// Files seldom hold meshes that stand on their heads, or along x.
constexpr double kUnusual = 0.5;

using Point = Eigen::Vector2d;

/// Twice the area of the triangle a b c, positive when counter-clockwise.
double turn(const Point& a, const Point& b, const Point& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

/// The area of the points' convex hull, by Andrew's chains.
double hull_area(std::vector<Point> points) {
  std::ranges::sort(points, [](const Point& a, const Point& b) {
    return std::pair(a.x(), a.y()) < std::pair(b.x(), b.y());
  });
  std::vector<Point> hull;
  for (int chain = 0; chain < 2; ++chain) {
    const std::size_t first = hull.size();
    for (const Point& p : points) {
      while (hull.size() >= first + 2 && turn(hull.end()[-2], hull.back(), p) <= 0) hull.pop_back();
      hull.push_back(p);
    }
    std::ranges::reverse(points);
  }
  double twice = 0;
  for (std::size_t i = 2; i < hull.size(); ++i) twice += turn(hull[0], hull[i - 1], hull[i]);
  return 0.5 * twice;
}

/// How wide and flat the end opposite to `up` is: the geometric mean of two shares of the box's
/// cross-section, that of the end's convex hull and that of the triangles in it.
double foot(const TriangleMesh& mesh, const Box& box, UpAxis up) {
  const int along = axis_number(up);
  const Eigen::Index first = (along + 1) % 3, second = (along + 2) % 3;
  const Eigen::Vector3d direction_up = direction(up);
  const double bottom = std::min(direction_up.dot(box.low), direction_up.dot(box.high));
  const double end = bottom + kEnd * box.size()[along];
  const auto flat = [&](const Eigen::Vector3d& x) { return Point(x[first], x[second]); };
  std::vector<Point> points;
  for (const Eigen::Vector3d& x : mesh.vertices) {
    if (direction_up.dot(x) < end) points.push_back(flat(x));
  }
  double area = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3d &p = mesh.vertices[a], &q = mesh.vertices[b], &r = mesh.vertices[c];
    if (direction_up.dot(p + q + r) >= 3 * end) continue;
    area += 0.5 * std::abs(turn(flat(p), flat(q), flat(r)));
  }
  const double section = box.size()[first] * box.size()[second];
  return section > 0 ? std::sqrt(hull_area(std::move(points)) * area) / section : 0;
}

}  // namespace

UpAxis guess_up(const TriangleMesh& mesh) {
  mesh.validate();
  const Box box = mesh.box();
  const UpAxis usual = mesh.format_up.value_or(kDefaultUp);
  UpAxis best = usual;
  double most = kClearly * foot(mesh, box, usual);
  for (const auto& [axis, worth] : {std::pair{UpAxis::y, 1.0},
                                    {UpAxis::z, 1.0},
                                    {UpAxis::minus_y, kUnusual},
                                    {UpAxis::minus_z, kUnusual},
                                    {UpAxis::x, kUnusual},
                                    {UpAxis::minus_x, kUnusual}}) {
    if (axis == usual) continue;
    const double found = foot(mesh, box, axis);
    if (found < kLeastFoot || worth * found <= most) continue;
    best = axis;
    most = worth * found;
  }
  return best;
}

}  // namespace qjulia
