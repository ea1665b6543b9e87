/// Polygons cut by their ears: the triangles cover the polygon and do not overlap.

#include <Eigen/Geometry>
#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <map>
#include <random>

#include "mesh/triangulate.hpp"
#include "shapes.hpp"

using namespace qjulia;

namespace {

using Polygon = std::vector<Eigen::Vector3d>;

/// Coordinates as they are read.
Eigen::Vector3d rounded(const Eigen::Vector3d& x) { return x.cast<float>().cast<double>(); }

struct Pieces {
  std::vector<Triangle> triangles;
  bool is_simple = false;
};

Pieces cut(const Polygon& polygon) {
  Pieces result;
  for (std::uint32_t i = 2; i < polygon.size(); ++i) result.triangles.push_back({0, i - 1, i});
  result.is_simple = shape::triangulate(polygon, result.triangles, [] {});
  return result;
}

double area(const Polygon& x, const Triangle& t) {
  return 0.5 * (x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]).norm();
}

/// Of a simple polygon in a plane.
double area(const Polygon& x) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < x.size(); ++i) sum += x[i].cross(x[(i + 1) % x.size()]);
  return 0.5 * sum.norm();
}

/// Triangles with the polygon's area in all, each with its orientation, and each edge of the
/// polygon and both sides of each diagonal used once: then they cover it without overlap.
void check_covers(const Polygon& polygon) {
  const Pieces result = cut(polygon);
  CHECK(result.is_simple);
  double sum = 0;
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const Triangle& t : result.triangles) {
    sum += area(polygon, t);
    for (std::size_t i = 0; i < 3; ++i) ++edges[{t[i], t[(i + 1) % 3]}];
  }
  CHECK(sum == Catch::Approx(area(polygon)).epsilon(1e-5));
  const auto n = static_cast<std::uint32_t>(polygon.size());
  bool once = true;
  for (const auto& [edge, uses] : edges) {
    const auto [a, b] = edge;
    once = once && uses == 1 && (b == (a + 1) % n) != (edges.count({b, a}) == 1);
  }
  CHECK(once);
  CHECK(edges.size() == 3 * (polygon.size() - 2));
}

/// In a plane that is parallel to no axis.
Polygon tilted(const std::vector<Eigen::Vector2d>& flat) {
  Polygon polygon;
  for (const auto& p : flat) {
    polygon.push_back(rounded({p.x() + 3, 0.5 * p.y() - 0.25 * p.x(), p.y() + p.x()}));
  }
  return polygon;
}

}  // namespace

TEST_CASE("a convex polygon stays the fan that it was") {
  const Polygon square = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  const Pieces result = cut(square);
  CHECK(result.is_simple);
  CHECK(result.triangles == std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}});
}

TEST_CASE("concave polygons are covered, wherever they begin and whichever way they face") {
  const std::vector<Eigen::Vector2d> shape = {{0, 0}, {4, 0}, {4, 4}, {3, 4},
                                              {3, 1}, {1, 1}, {1, 4}, {0, 4}};
  for (std::size_t first = 0; first < shape.size(); ++first) {
    std::vector<Eigen::Vector2d> turned = shape;
    std::ranges::rotate(turned, turned.begin() + static_cast<std::ptrdiff_t>(first));
    CAPTURE(first);
    check_covers(tilted(turned));
    std::ranges::reverse(turned);
    check_covers(tilted(turned));
  }
  // An arrowhead: the fan about its first corner has the area 65.
  const Polygon arrow = {{10, 0, 0}, {5, 1, 0}, {5, 9, 0}, {0, 0, 0}};
  CHECK(area(arrow) == Catch::Approx(25));
  check_covers(arrow);
}

TEST_CASE("stars of many corners are covered") {
  std::mt19937 random(3);
  for (int trial = 0; trial < 40; ++trial) {
    std::vector<Eigen::Vector2d> star;
    const int corners = 5 + 7 * trial;
    for (int i = 0; i < corners; ++i) {
      const double angle = 2 * std::numbers::pi * i / corners;
      const double radius = 1.5 + shapes::centred(random);
      star.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
    }
    CAPTURE(trial);
    check_covers(tilted(star));
  }
}

TEST_CASE("corners in one line are kept") {
  // Each side of a square in four, so that neighbours with the same corners leave no gap.
  std::vector<Eigen::Vector2d> square;
  for (int i = 0; i < 4; ++i) square.emplace_back(i, 0);
  for (int i = 0; i < 4; ++i) square.emplace_back(4, i);
  for (int i = 0; i < 4; ++i) square.emplace_back(4 - i, 4);
  for (int i = 0; i < 4; ++i) square.emplace_back(0, 4 - i);
  Polygon polygon;
  for (const auto& p : square) polygon.emplace_back(p.x(), p.y(), 0);
  check_covers(polygon);
  const Pieces result = cut(polygon);
  CHECK(std::ranges::all_of(result.triangles,
                            [&](const Triangle& t) { return area(polygon, t) > 0.1; }));
}

TEST_CASE("a hole that a bridge joins to the boundary stays open") {
  const Polygon ring = {{0, 0, 0}, {6, 0, 0}, {6, 6, 0}, {0, 6, 0}, {0, 0, 0},
                        {2, 2, 0}, {2, 4, 0}, {4, 4, 0}, {4, 2, 0}, {2, 2, 0}};
  const Pieces result = cut(ring);
  CHECK(result.is_simple);
  double sum = 0;
  for (const Triangle& t : result.triangles) sum += area(ring, t);
  CHECK(sum == Catch::Approx(32));
}

TEST_CASE("orientations are exact where double precision rounds them to none") {
  const auto kite = [](float x) { return Polygon{{x, 0, 0}, {1, 1, 0}, {2, 2, 0}, {0, 2, 0}}; };
  const std::vector<Triangle> fan = {{0, 1, 2}, {0, 2, 3}};
  CHECK(cut(kite(-1e-20F)).triangles == fan);  // the second corner turns left, by 1e-20
  CHECK(cut(kite(1e-20F)).triangles != fan);   // and right
}

TEST_CASE("repeated corners give triangles without area") {
  const Polygon polygon = {{0, 0, 0}, {4, 0, 0}, {4, 0, 0}, {1, 1, 0}, {0, 4, 0}, {0, 4, 0}};
  const Pieces result = cut(polygon);
  CHECK(result.is_simple);
  double sum = 0;
  for (const Triangle& t : result.triangles) sum += area(polygon, t);
  CHECK(sum == Catch::Approx(4));
}

TEST_CASE("polygons that cross themselves or have no area are told") {
  CHECK_FALSE(cut({{0, 0, 0}, {2, 2, 0}, {2, 0, 0}, {0, 1, 0}}).is_simple);
  CHECK_FALSE(cut({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {1.5, 0, 0}}).is_simple);
}

TEST_CASE("a polygon of many corners that cross is given up in time") {
  std::mt19937 random(4);
  Polygon tangle;
  for (int i = 0; i < 20'000; ++i) {
    tangle.push_back(rounded({shapes::centred(random), shapes::centred(random), 0}));
  }
  int polls = 0;
  std::vector<Triangle> fan;
  for (std::uint32_t i = 2; i < tangle.size(); ++i) fan.push_back({0, i - 1, i});
  CHECK_FALSE(shape::triangulate(tangle, fan, [&] { ++polls; }));
  CHECK(std::ranges::all_of(fan, [&](const Triangle& t) {
    return std::ranges::all_of(t, [&](auto v) { return v < tangle.size(); });
  }));
}
