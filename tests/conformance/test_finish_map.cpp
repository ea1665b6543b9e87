// From a map in distance units to the one a user gets, on a ball, where all is known.

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <stop_token>

#include "fit/finish_map.hpp"
#include "fit/sample_pool.hpp"
#include "map/reference_iteration.hpp"
#include "qjulia/error.hpp"
#include "shapes.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

constexpr double kRadius = 1.5;  // of the ball in map units

/// A ball of radius 4 about (10, 0, 0), and points for measuring it.
struct Ball {
  Shape shape;
  fitting::SamplePool pool;
  Ball()
      : shape(make_shape(test::shared_device(), shapes::moved(shapes::sphere(5), 4, {10, 0, 0}))) {
    pool.surface = sample_surface(shape.mesh, 5000, 1);
  }
};

const Ball& ball() {
  static const Ball ball;
  return ball;
}

Map finished(const Map& map, double iou, double detail, std::vector<std::string>& warnings) {
  return fitting::finish_map(test::shared_device(), map, iou, ball().shape, ball().pool, detail,
                             warnings);
}

/// F_1 = r₀ ln (|q| / r₀) + 0.2, whose slope is 1 on the ball's surface.
Map in_distance_units() {
  Map map;
  map.dynamics.log_scale = -kRadius * std::log(kRadius) + 0.2;
  map.dynamics.factors = {{{0, 0, 0, 0}, kRadius}};
  return map;
}

double potential_at(const Map& map, const Quaternion& q) {
  return reference::field(map, std::vector{q}, 1, 20).front();
}

}  // namespace

TEST_CASE("a finished map has the wanted shell, its level and scale, and the shape's coordinates") {
  std::vector<std::string> warnings;
  const double detail = GENERATE(0.01, 0.03);
  const Map map = finished(in_distance_units(), 0.99, detail, warnings);
  CHECK(warnings.empty());
  REQUIRE(map.frame.detail.has_value());
  CHECK(*map.frame.detail == Approx(detail));
  // The shell is δ of the diagonal of the ball's box thick: slope a / r₀ = 1 / (δ 2 √3 r₀).
  const double exponent = 1 / (detail * 2 * std::numbers::sqrt3);
  CHECK(map.dynamics.factors.front().exponent == Approx(exponent).epsilon(2e-3));
  // Calibrated: the set reaches to the surface, where F_1 is ln r₀.
  CHECK(map.dynamics.surface_level == Approx(std::log(kRadius)).margin(5e-3));
  CHECK(potential_at(map, {kRadius, 0, 0, 0}) == Approx(map.dynamics.surface_level).margin(0.02));
  CHECK(*map.frame.inradius == Approx(4).epsilon(5e-3));
  CHECK(map.frame.box->center().x() == Approx(10));
  CHECK(map.frame.shape_to_map.to_map({10, 4, 0}).isApprox(Eigen::Vector3d(0, kRadius, 0), 1e-3));
}

TEST_CASE(
    "what was finished and polished since gets its shell's thickness back, and nothing else") {
  std::vector<std::string> warnings;
  const Map map = finished(in_distance_units(), 0.99, 0.02, warnings);
  Map polished = map;
  polished.dynamics.factors.front().exponent *= 1.3;
  const Map back = finished(polished, 0.5, 0.02, warnings);
  CHECK(warnings.empty());
  CHECK(back.dynamics.factors.front().exponent == Approx(map.dynamics.factors.front().exponent));
  CHECK(back.frame.shape_to_map.scale == map.frame.shape_to_map.scale);
  CHECK(*back.frame.detail == Approx(0.02));
}

TEST_CASE("warnings say what is wrong with the map, and where") {
  std::vector<std::string> warnings;
  // A poor fit: the surface is missed about (16, 0, 0), or the far side.
  Map off = in_distance_units();
  off.dynamics.factors.front().center.x = 0.3;
  finished(off, 0.5, 0.02, warnings);
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings.front(), Catch::Contains("IoU of 0.50") && Catch::Contains("near (14, "));

  // A pole where the deepest point is: no calibration.
  warnings.clear();
  Map outside;
  outside.dynamics.factors = {{{0, 0, 0, 0}, -1}, {{2, 0, 0, 0}, 1.5}, {{-2, 0, 0, 0}, 1.5}};
  const Map uncalibrated = finished(outside, 0.95, 0.02, warnings);
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings.front(), Catch::Contains("does not hold the shape's deepest point inside"));
  CHECK(uncalibrated.dynamics.surface_level == 0);

  // A thick shell about an origin that is not deep.
  warnings.clear();
  Map shallow;
  shallow.dynamics.factors = {{{1, 0, 0, 0}, kRadius / 2}, {{-1, 0, 0, 0}, kRadius / 2}};
  finished(shallow, 0.95, 0.1, warnings);
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings.front(), Catch::Contains("near dissolving"));
}

TEST_CASE("a shell that leaves the set unbounded is made thinner, and no fit is lost by it") {
  std::vector<std::string> warnings;
  // The slope r₀ / r₀ = 1 makes δ = 1 / (2 √3 r₀) of the diagonal, with an exponent of r₀.
  const double most = kRadius / (2 * std::numbers::sqrt3 * kRadius);
  const Map thick = finished(in_distance_units(), 0.99, 1.5 * most, warnings);
  CHECK(thick.dynamics.degree() == Approx(1.1));
  CHECK(*thick.frame.detail == Approx(most / 1.1).epsilon(2e-3));

  Map repelling = in_distance_units();
  repelling.dynamics.factors.push_back({{9, 0, 0, 0}, -2 * kRadius});
  const Map unbounded = finished(repelling, 0.99, 0.02, warnings);
  CHECK(unbounded.dynamics.degree() == Approx(-kRadius));
  CHECK(unbounded.frame.detail.has_value());
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings.front(), Catch::Contains("the exponents sum to -1.5: no detail bounds"));
}

TEST_CASE("a stop request ends the taking of samples") {
  std::stop_source stopped;
  stopped.request_stop();
  const Shape& shape = ball().shape;
  const SignedDistance distance(test::shared_device(), shape.mesh);
  CHECK_THROWS_AS(fitting::make_sample_pool(shape, distance, 1, 1000, 1000, stopped.get_token()),
                  Interrupted);
  fitting::Level level;
  level.samples = 8;
  CHECK_THROWS_AS(fitting::grid_samples(shape, distance, level, stopped.get_token()), Interrupted);
}
