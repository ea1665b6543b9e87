// Maps whose modulus is a distance, through everything that iterates maps.

#include <catch2/catch_all.hpp>
#include <cmath>

#include "base/larger_error.hpp"
#include "distance_map.hpp"
#include "lattice/level_set.hpp"
#include "map/reference_iteration.hpp"
#include "map_checks.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/exact/exact_map.hpp"
#include "qjulia/map/knobs.hpp"
#include "qjulia/picture/picture.hpp"
#include "qjulia/surface/compare.hpp"
#include "qjulia/surface/surface.hpp"
#include "shapes.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

const Device& distance_device() { return test::shared_device(); }

/// Within the grid's domain, beyond it, and out of the slice.
std::vector<Quaternion> points_about(double reach, std::size_t count) {
  return test::random_points(4, count, reach, 0.4);
}

DistanceModulus& modulus_of(Map& map) { return std::get<DistanceModulus>(map.dynamics.modulus); }

}  // namespace

TEST_CASE("bounds over cubes hold F, within the domain and across its end") {
  const auto variant = GENERATE(from_range(test::variants()));
  Map map = test::distance_map();
  map.dynamics.slice = 0.1;
  const surface::LevelSet set(variant.of(test::shared_device()), map, {0.4, 1.9, 50}, 1);
  const double half_side = GENERATE(0.01, 0.1, 0.4);
  std::mt19937_64 bits(9);
  std::vector<Eigen::Vector3d> centers;
  for (int i = 0; i < 61; ++i) {
    const double x = test::uniform(bits, -2, 2);
    const double y = test::uniform(bits, -2, 2);
    centers.emplace_back(x, y, test::uniform(bits, -2, 2));
  }
  const auto bounds = set.bounds(centers, half_side);
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < centers.size(); ++i) {
    for (int k = 0; k < 60; ++k) {
      const auto offset = [&] { return half_side * test::uniform(bits, -1, 1); };
      const double x = centers[i].x() + offset();
      const double y = centers[i].y() + offset();
      const double f =
          reference::step(map, {x, y, centers[i].z() + offset(), map.dynamics.slice}).log_norm;
      if (f < static_cast<double>(bounds.low[i]) || f > static_cast<double>(bounds.high[i])) {
        ++wrong;
      }
    }
    // No wider than a slope of 1.6 makes them, in or √(1 + 1.6²) out of the domain.
    const double width = static_cast<double>(bounds.high[i] - bounds.low[i]);
    CHECK(width < 2 * half_side * std::sqrt(3.0) * 1.95 / modulus_of(map).shell + 0.1);
  }
  CHECK(wrong == 0);
}

TEST_CASE("its radii decide no orbit wrongly, and none returns from beyond r_out") {
  Map map = test::distance_map();
  const StopRadii stops = find_stop_radii(distance_device(), map);
  CHECK(stops.inner > 0.3);
  CHECK(stops.outer < 2.2);
  CHECK(stops.escape == Catch::Approx(1.25 * stops.outer));
  std::mt19937_64 bits(6);
  for (int i = 0; i < 3000; ++i) {
    const auto at = [&] { return test::uniform(bits, -3, 3); };
    const double x = at();
    const double y = at();
    const double z = at();
    const Quaternion q{x, y, z, at()};
    if (norm(q) > stops.outer) CHECK(reference::step(map, q).log_norm > std::log(norm(q)));
  }
  const auto points = points_about(1.4, 1500);
  CHECK(test::wrongly_decided(map, stops, points) <= 3);  // by rounding, at the set's boundary
  modulus_of(map).fourth = FourthCoordinate::ignored;
  CHECK_FALSE(std::isfinite(find_stop_radii(distance_device(), map).outer));
}

TEST_CASE("the sparse surface is the dense one") {
  const auto variant = GENERATE(from_range(test::variants()));
  const Device device = variant.of(distance_device());
  Map map = test::distance_map(0.08);
  if (GENERATE(false, true)) modulus_of(map).fourth = FourthCoordinate::ignored;
  SurfaceOptions options;
  options.resolution = 80;
  const SurfaceReport report = test::checked_surface(device, map, options).report;
  CHECK(report.potentials < report.grid_points / 2);
}

TEST_CASE("at n = 1 the set is the shape") {
  Map map = test::distance_map();
  SurfaceOptions options;
  options.resolution = 64;
  options.iterations = 1;
  double worst = 0;
  for (const auto& x : extract_surface(distance_device(), map, options).vertices) {
    worst = base::larger_error(worst, std::abs(test::two_balls(x)));
  }
  CHECK(worst < 0.4 * modulus_of(map).step);
}

TEST_CASE("knobs turn the shell, the roots and the origin, and what cannot turn says so") {
  Map map = test::distance_map();
  const auto with = [&](auto change) {
    MapKnobs knobs;
    change(knobs);
    return with_knobs(distance_device(), map, knobs);
  };
  Map thick = with([&](MapKnobs& k) { k.detail = 2 * *map.frame.detail; });
  CHECK(modulus_of(thick).shell == Catch::Approx(2 * modulus_of(map).shell));
  CHECK(thick.dynamics.factors[0].exponent == map.dynamics.factors[0].exponent);
  CHECK(thick.dynamics.surface_level == Catch::Approx(map.dynamics.surface_level));
  CHECK(with([](MapKnobs& k) { k.order_seed = 3; }).dynamics.factors[0].center !=
        map.dynamics.factors[0].center);
  Map moved = with([](MapKnobs& k) { k.translate = Eigen::Vector3d(0.2, 0, 0); });
  // The shape stays in its own coordinates.
  const Eigen::Vector3d x(0.55, 0.2, 0.3);
  const auto f = [&](const Map& m) {
    const Eigen::Vector3d p = m.frame.shape_to_map.to_map(x);
    return reference::step(m, {p.x(), p.y(), p.z(), 0}).log_norm - m.dynamics.surface_level;
  };
  CHECK(f(moved) == Catch::Approx(f(map)).margin(1e-6));
  CHECK(moved.dynamics.factors[0].center.x ==
        Catch::Approx(map.dynamics.factors[0].center.x + 0.2));
  CHECK_THROWS_WITH(with([](MapKnobs& k) {
                      k.rotate = Rotation{{0, 1, 0}, 90};
                    }),
                    Catch::Matchers::ContainsSubstring("rotate"));
}

TEST_CASE("an exact map has the mesh's shape") {
  const TriangleMesh mesh = GENERATE(shapes::torus(), shapes::box({-1, -0.7, -0.4}, {1, 0.7, 0.4}),
                                     shapes::moved(shapes::sphere(), 40, {100, -20, 3}));
  ExactMapOptions options;
  options.resolution = 96;
  options.detail = 0.01;
  options.versor = RandomRoots{.roots = 8};
  const Map map = exact_map(distance_device(), mesh, options);
  map.validate();
  CHECK(map.dynamics.factors.size() == 8);
  for (const Factor& factor : map.dynamics.factors) {
    CHECK(factor.exponent >= 2);
    CHECK(factor.exponent <= 13);
    CHECK(factor.exponent == std::round(factor.exponent));
    CHECK(reference::step(map, factor.center).log_norm < map.dynamics.surface_level);
  }
  CompareOptions compared;
  compared.resolution = 64;
  const auto metrics = compare(distance_device(), map, mesh, compared);
  CHECK(metrics[0].iou > 0.995);
  CHECK(metrics[0].slope_variation < 0.08);  // a box has edges
  CHECK(metrics[1].iou > 0.93);
}

TEST_CASE("an exact map is the same every time, and another with another seed") {
  const TriangleMesh mesh = shapes::torus();
  ExactMapOptions options;
  options.resolution = 48;
  const auto first = exact_map(distance_device(), mesh, options);
  const auto again = exact_map(distance_device(), mesh, options);
  CHECK(first.dynamics.modulus == again.dynamics.modulus);
  CHECK(first.dynamics.factors[5].center == again.dynamics.factors[5].center);
  options.versor = RandomRoots{.seed = 2};
  CHECK(exact_map(distance_device(), mesh, options).dynamics.factors[5].center !=
        first.dynamics.factors[5].center);
}

TEST_CASE("the detail that suits a mesh is the same wherever the mesh lies, in any unit") {
  const auto detail_of = [](const TriangleMesh& mesh) {
    ExactMapOptions options;
    options.resolution = 48;
    return exact_map(distance_device(), mesh, options).frame.detail.value();
  };
  const TriangleMesh mesh = shapes::box({-1, -0.7, -0.4}, {1, 0.7, 0.4});
  const double detail = detail_of(mesh);
  CHECK(detail_of(shapes::moved(mesh, 1, {2, -1, 5})) == Catch::Approx(detail).epsilon(1e-3));
  CHECK(detail_of(shapes::moved(mesh, 1e6, {0, 0, 0})) == Catch::Approx(detail).epsilon(1e-3));
}

TEST_CASE("factors of another map keep their places in the shape") {
  const TriangleMesh mesh = shapes::torus();
  ExactMapOptions options;
  options.resolution = 48;
  options.versor =
      FactorsOfMap{{{{0.4, 0.1, -0.2, 0.3}, 1.5}, {{0, 0.2, 0, 0}, -0.5}}, {0.5, {0.1, 0, 0}}};
  const Map map = exact_map(distance_device(), mesh, options);
  const Eigen::Vector3d expected = map.frame.shape_to_map.to_map({0.6, 0.2, -0.4});
  CHECK(map.dynamics.factors[0].center.x == Catch::Approx(expected.x()));
  CHECK(map.dynamics.factors[0].center.z == Catch::Approx(expected.z()));
  CHECK(map.dynamics.factors[0].center.w ==
        Catch::Approx(0.3 * map.frame.shape_to_map.scale / 0.5));
  CHECK(map.dynamics.factors[1].exponent == -0.5);
}

TEST_CASE("options of exact maps are checked") {
  const auto refused = [](auto change, const char* field) {
    ExactMapOptions options;
    change(options);
    CHECK_THROWS_WITH(options.validate(), Catch::Matchers::ContainsSubstring(field));
  };
  refused([](ExactMapOptions& o) { o.resolution = 8; }, "resolution");
  refused([](ExactMapOptions& o) { o.resolution = 1000; }, "resolution");
  refused([](ExactMapOptions& o) { o.detail = 0.0; }, "detail");
  refused([](ExactMapOptions& o) { o.steepness = 0.5; }, "steepness");
  refused([](ExactMapOptions& o) { o.versor = RandomRoots{.roots = 0}; }, "roots");
  refused([](ExactMapOptions& o) { o.versor = FactorsOfMap{}; }, "versor");
}

TEST_CASE("a picture of a ball by its distance is that of a ball by a root") {
  ExactMapOptions options;
  options.resolution = 64;
  options.versor = RandomRoots{.roots = 1};
  const Map exact = exact_map(distance_device(), shapes::sphere(4), options);
  PictureOptions picture;
  picture.width = picture.height = 48;
  picture.samples = 1;
  picture.iterations = 1;
  const Image image = render(distance_device(), exact, picture);
  Map root;
  root.dynamics.factors = {{{}, 2}};
  root.frame.shape_to_map = exact.frame.shape_to_map;
  root.frame.box = exact.frame.box;
  root.dynamics.log_scale = -2 * std::log(1.5);  // F_1 = 0 at radius 1.5, map units
  const Image expected = render(distance_device(), root, picture);
  REQUIRE(image.pixels.size() == expected.pixels.size());
  int different = 0;
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    if (std::abs(int{image.pixels[i]} - int{expected.pixels[i]}) > 12) ++different;
  }
  CHECK(different < 150);  // of 6912, at the rim
}
