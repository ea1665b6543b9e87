// Maps whose detail is painted, through everything that iterates maps.

#include <catch2/catch_all.hpp>
#include <cmath>

#include "distance_map.hpp"
#include "lattice/level_set.hpp"
#include "map/reference_iteration.hpp"
#include "map_checks.hpp"
#include "patchy_paint.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/edit/painting.hpp"
#include "qjulia/map/knobs.hpp"
#include "qjulia/surface/surface.hpp"
#include "shapes.hpp"
#include "test_device.hpp"

using namespace qjulia;
using Eigen::Vector3d;

namespace {

Paint even_paint(std::uint8_t share) {
  Paint paint = test::patchy_paint();
  paint.shares.assign(paint.size(), share);
  return paint;
}

Map painted_map(const Paint& paint = test::patchy_paint()) {
  Map map = test::distance_map(0.12);
  map.dynamics.phase = {0.8, 0, 0.6, 0};
  map.layers.paint = paint;
  return map;
}

Map painted_factors() {
  Map map = test::random_map(9, 0.2, 0.9, 3);
  map.dynamics.surface_level = -0.2;
  map.layers.steepness = 1.5;
  map.layers.paint = test::patchy_paint();
  return map;
}

Map painted_noise() {
  Map map = painted_map();
  map.dynamics.factors.clear();
  map.dynamics.versor = NoiseVersor{2, 4.3, 30, NoiseValues::quaternions, {0.1, -0.2, 0.05}};
  return map;
}

std::vector<Quaternion> painted_points(double reach, std::size_t count) {
  return test::random_points(21, count, reach, 0.3 * reach);
}

}  // namespace

TEST_CASE("a paint is the share of the detail") {
  const auto points = painted_points(1.4, 600);
  const Map plain = without_paint(painted_map());
  // Everywhere the same: as a smaller detail.
  const Map quarter = painted_map(even_paint(63));
  MapKnobs knobs;
  knobs.detail = *plain.frame.detail / 4;
  const Map smaller = with_knobs(test::shared_device(), plain, knobs);
  const auto expected = reference::field(smaller, points, 1, 20);
  const auto found = reference::field(quarter, points, 1, 20);
  const Field field(test::shared_device(), painted_map());
  for (std::size_t i = 0; i < points.size(); ++i) {
    CHECK(found[i] == Catch::Approx(expected[i]).margin(1e-9));
    const Vector3d x(points[i].x, points[i].y, points[i].z);
    CHECK(quarter.layers.paint->at(x) == Catch::Approx(0.25).epsilon(1e-12));
  }
  // F - L is divided by what the paint itself says.
  const Map patchy = painted_map();
  const auto thin = reference::field(patchy, points, 1, 1e9);
  const auto thick = reference::field(plain, points, 1, 1e9);
  const double level = plain.dynamics.surface_level;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double m = patchy.layers.paint->at({points[i].x, points[i].y, points[i].z});
    CHECK((thin[i] - level) * m == Catch::Approx(thick[i] - level).margin(1e-9));
    CHECK((m >= Paint::kLeastShare && m <= 1));
  }
  CHECK(painted_share(0) == 0);
  CHECK(painted_share(1) == 255);
  CHECK(painted_share(0.25) == 63);
}

TEST_CASE("a paint that leaves all places the whole detail changes no bit") {
  const auto variant = GENERATE(from_range(test::variants()));
  const Map map = GENERATE(painted_map(even_paint(255)), [] {
    Map factors = painted_factors();
    factors.layers.paint = even_paint(255);
    return factors;
  }());
  const auto points = painted_points(1.6, 500);
  const Device device = variant.of(test::shared_device());
  for (const int n : {1, 4}) {
    CHECK(Field(device, map).at(points, n) == Field(device, without_paint(map)).at(points, n));
  }
}

TEST_CASE("the gradient of a painted map is that of its F") {
  const auto variant = GENERATE(from_range(test::variants()));
  const Map map = GENERATE(painted_map(), painted_factors());
  const auto points = painted_points(1.9, 400);
  const Field field(variant.of(test::shared_device()), map, Precision::single);
  const auto errors = test::sorted_gradient_errors(field, map, points, 1e-6);
  CHECK(errors[errors.size() * 98 / 100] < 5e-3);
}

TEST_CASE("bounds of a painted map over cubes hold") {
  const auto variant = GENERATE(from_range(test::variants()));
  const Map map = GENERATE(painted_map(), painted_factors());
  const double half_side = GENERATE(0.005, 0.05, 0.3, 1.5);
  const surface::LevelSet set(variant.of(test::shared_device()), map, {}, 1);
  std::mt19937_64 bits(9);
  std::vector<Eigen::Vector3d> centers;
  for (std::size_t i = 0; i < 151; ++i) {
    const double x = test::uniform(bits, -2.2, 1.8);
    const double y = test::uniform(bits, -1.4, 1.6);
    centers.emplace_back(x, y, test::uniform(bits, -1.2, 1.2));
  }
  const auto bounds = set.bounds(centers, half_side);
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < centers.size(); ++i) {
    std::vector<Quaternion> points;
    for (int k = 0; k < 40; ++k) {
      const auto offset = [&] { return half_side * test::uniform(bits, -1, 1); };
      const double x = centers[i].x() + offset();
      const double y = centers[i].y() + offset();
      points.push_back({x, y, centers[i].z() + offset(), map.dynamics.slice});
    }
    const auto low = static_cast<double>(bounds.low[i]), high = static_cast<double>(bounds.high[i]);
    for (const double f : reference::field(map, points, 1, 1e6)) {
      if (f < low || f > high) ++wrong;
    }
  }
  CAPTURE(half_side);
  CHECK(wrong == 0);
  // Where paint is even they are as close as those of a smaller detail.
  Map even = map;
  even.layers.paint = even_paint(63);
  const auto of_even =
      surface::LevelSet(test::shared_device(), even, {}, 1).bounds(centers, half_side);
  const auto plain = surface::LevelSet(test::shared_device(), without_paint(map), {}, 1)
                         .bounds(centers, half_side);
  for (std::size_t i = 0; i < centers.size(); ++i) {
    CHECK(of_even.high[i] - of_even.low[i] <= 4.01F * (plain.high[i] - plain.low[i]) + 1e-3F);
  }
}

TEST_CASE("the sparse surface of a painted map is the dense one") {
  const auto variant = GENERATE(from_range(test::variants()));
  const Device device = variant.of(test::shared_device());
  const Map map = GENERATE(painted_map(), painted_noise());
  SurfaceOptions options;
  options.resolution = 80;
  options.iterations = GENERATE(1, 6);
  const SurfaceReport report = test::checked_surface(device, map, options).report;
  CHECK(report.potentials < report.grid_points * 4 / 5);
}

TEST_CASE("where the share is least the surface is the smooth shape") {
  // The large ball smooth, the small one wild.
  Paint paint = even_paint(255);
  for (int k = 0; k < paint.cells[2]; ++k) {
    for (int j = 0; j < paint.cells[1]; ++j) {
      for (int i = 0; i < paint.cells[0]; ++i) {
        const auto number = static_cast<std::size_t>((k * paint.cells[1] + j) * paint.cells[0] + i);
        if (paint.center(i, j, k).x() > -0.35) paint.shares[number] = 0;
      }
    }
  }
  Map map = painted_map(paint);
  SurfaceOptions options;
  options.resolution = 96;
  const TriangleMesh mesh = extract_surface(test::shared_device(), map, options);
  map.layers.paint.reset();
  const TriangleMesh wild = extract_surface(test::shared_device(), map, options);
  const auto off_by = [](const TriangleMesh& of, double from, double to) {
    double sum = 0;
    std::size_t count = 0;
    for (const Vector3d& x : of.vertices) {
      if (x.x() < from || x.x() > to) continue;
      sum += std::abs(test::two_balls(x));
      ++count;
    }
    return sum / static_cast<double>(std::max<std::size_t>(1, count));
  };
  CHECK(off_by(mesh, 0.3, 2) < 0.005);
  CHECK(off_by(wild, 0.3, 2) > 0.01);
  CHECK(off_by(mesh, -2, -1) > 0.01);
}

TEST_CASE("rays find the set that a painted map's orbits have") {
  const auto variant = GENERATE(from_range(test::variants()));
  const Map map = painted_map();
  test::check_rays(variant.of(test::shared_device()), map, *map.frame.box, GENERATE(1, 5));
}

TEST_CASE("knobs move a paint with the shape, and cannot turn it") {
  const Map map = painted_map();
  MapKnobs knobs;
  knobs.translate = Vector3d(0.05, -0.1, 0.02);
  const Map moved = with_knobs(test::shared_device(), map, knobs);
  for (const Quaternion& q : painted_points(1.2, 50)) {
    const Vector3d x(q.x, q.y, q.z);
    CHECK(moved.layers.paint->at(x + *knobs.translate) == Catch::Approx(map.layers.paint->at(x)));
  }
  knobs = {};
  knobs.rotate = Rotation{{1, 0, 0}, 35};
  CHECK_THROWS_WITH(with_knobs(test::shared_device(), painted_factors(), knobs),
                    Catch::Matchers::ContainsSubstring("paint"));
}

TEST_CASE("balls, blocks, a ramp and what is elsewhere are painted in their order") {
  Map map = test::distance_map(0.05);
  map.frame.shape_to_map = {0.5, {0.1, 0, 0}};  // the shape's own box
  const Box box = *map.frame.box;
  map.frame.box =
      Box{map.frame.shape_to_map.to_shape(box.low), map.frame.shape_to_map.to_shape(box.high)};
  const auto at = [&](const Paint& paint, const Vector3d& x) {
    return paint.at(map.frame.shape_to_map.to_map(x));
  };
  PaintOptions options;
  options.elsewhere = 0.75;
  options.blocks = {{{{-2, -1, -1}, {0, 0, 1}}, 0.5}};
  options.balls = {{{-1, -0.5, 0}, 0.9, 0}, {{-1, -0.5, 0}, 0.25, 1}};
  const Paint paint = painted(test::shared_device(), map, options);
  CHECK_NOTHROW(paint.validate());
  CHECK(paint.size() > 20000);
  CHECK(at(paint, {-1, -0.5, 0}) == Catch::Approx(1));
  CHECK(at(paint, {-1, -0.5, 0.65}) == Catch::Approx(Paint::kLeastShare));
  CHECK(at(paint, {-0.25, -0.25, -0.9}) == Catch::Approx(0.5).margin(0.003));
  CHECK(at(paint, {1, 0.5, 0}) == Catch::Approx(0.75).margin(0.003));

  options = {};
  options.ramp = PaintRamp{1, 1, 0.2};
  const Paint ramp = painted(test::shared_device(), map, options);
  const double low = map.frame.box->low.y(), high = map.frame.box->high.y();
  CHECK(at(ramp, {0, low - 1, 0}) == Catch::Approx(1).margin(0.01));
  CHECK(at(ramp, {0.3, 0.5 * (low + high), 0.2}) == Catch::Approx(0.6).margin(0.01));
  CHECK(at(ramp, {0, high + 1, 0}) == Catch::Approx(0.2).margin(0.01));

  const auto refused = [&](const auto& change, const char* part) {
    PaintOptions wrong;
    change(wrong);
    CHECK_THROWS_WITH(wrong.validate(), Catch::Matchers::ContainsSubstring(part));
  };
  refused([](PaintOptions& o) { o.elsewhere = 1.1; }, "elsewhere");
  refused([](PaintOptions& o) { o.balls = {{{0, 0, 0}, 0, 1}}; }, "balls");
  refused([](PaintOptions& o) { o.balls = {{{0, 0, 0}, 1, -0.1}}; }, "balls");
  refused([](PaintOptions& o) { o.blocks = {{{{0, 0, 0}, {1, 0, 1}}, 1}}; }, "blocks");
  refused([](PaintOptions& o) { o.ramp = PaintRamp{0, 0, NAN}; }, "ramp");
  refused([](PaintOptions& o) { o.thickness = 0; }, "thickness");
  map.frame.box.reset();
  CHECK_THROWS_WITH(painted(test::shared_device(), map, {}),
                    Catch::Matchers::ContainsSubstring("\"box\""));
}

TEST_CASE("balls are painted over what a map has, or over all of its detail") {
  Map map = without_paint(painted_map());
  const PaintBall smooth{{0.3, 0.2, 0}, 0.3, 0.25}, rough{{-0.4, 0, 0}, 0.2, 0.75};
  const Paint once = painted_over(map, {smooth, rough});
  CHECK(once == painted(test::shared_device(), map, {.balls = {smooth, rough}}));
  // One after the other, each to the nearest share that a paint holds.
  map.layers.paint = painted_over(map, {smooth});
  const Paint twice = painted_over(map, {rough});
  REQUIRE(twice.shares.size() == once.shares.size());
  for (std::size_t i = 0; i < once.shares.size(); ++i) {
    CHECK(std::abs(int{twice.shares[i]} - int{once.shares[i]}) <= 1);
  }
  CHECK(painted_over(map, {}) == *map.layers.paint);
  // Paint that the map has keeps its cells, and needs no box.
  map.layers.paint = test::patchy_paint();
  map.frame.box.reset();
  const Paint over = painted_over(map, {{{0, 0, 0}, 100, 1}});
  CHECK(over.cells == test::patchy_paint().cells);
  CHECK(std::ranges::count(over.shares, Paint::kWhole) == std::ssize(over.shares));
  map.layers.paint.reset();
  CHECK_THROWS_AS(painted_over(map, {smooth}), InputError);
  CHECK_THROWS_AS(painted_over(map, {{{0, 0, 0}, 1, 1.5}}), OptionError);
}

TEST_CASE("a mesh's shares are where the mesh is, and go on from there") {
  const Map map = test::distance_map(0.05);
  PaintOptions options;
  options.mesh = PaintedMesh{};
  const TriangleMesh ball = shapes::sphere(3, 0.7);
  for (const Vector3d& x : ball.vertices) {
    options.mesh->vertices.push_back(x + Vector3d(0.1, 0, 0));
    options.mesh->shares.push_back(x.z() > 0 ? 0.8F : 0.1F);
  }
  options.mesh->triangles = ball.triangles;
  const Paint paint = painted(test::shared_device(), map, options);
  CHECK(paint.at({0.1, 0, 0.7}) == Catch::Approx(0.8).margin(0.02));
  CHECK(paint.at({0.1, 0, -0.7}) == Catch::Approx(0.1).margin(0.02));
  CHECK(paint.at({0.1, 0.1, 0.4}) == Catch::Approx(0.8).margin(0.05));
  CHECK(paint.at({0.4, 0.1, -0.3}) == Catch::Approx(0.1).margin(0.05));
}

TEST_CASE("thickness is the radius of the largest ball, and bounds the shell by it") {
  Map map = test::distance_map(0.1);
  PaintOptions options;
  options.thickness = 0.16;
  const Paint paint = painted(test::shared_device(), map, options);
  const auto share = [&](double radius) { return std::min(1.0, 0.16 * radius / 0.1); };
  // The balls' far sides: radii .7 and .45.
  CHECK(paint.at({0.8, 0, 0}) == Catch::Approx(share(0.7)).margin(0.06));
  CHECK(paint.at({0.1, -0.7, 0}) == Catch::Approx(share(0.7)).margin(0.06));
  CHECK(paint.at({-1.33, 0.42, 0.14}) == Catch::Approx(share(0.45)).margin(0.06));
  CHECK(paint.at({-0.9, 0.3, 0.55}) == Catch::Approx(share(0.45)).margin(0.06));
  // A smaller detail leaves more of itself; by hand it can only be less.
  map = test::distance_map(0.05);
  options.balls = {{{0.8, 0, 0}, 0.2, 0.3}};
  const Paint finer = painted(test::shared_device(), map, options);
  CHECK(finer.at({0.1, -0.7, 0}) == Catch::Approx(1).margin(0.01));
  CHECK(finer.at({0.8, 0, 0}) == Catch::Approx(0.3).margin(0.02));
  map.frame.detail.reset();
  CHECK_THROWS_WITH(painted(test::shared_device(), map, options),
                    Catch::Matchers::ContainsSubstring("\"detail\""));
}
