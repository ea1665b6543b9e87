// What is asked of points: orbits that go far, points that cannot be evaluated, and none.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/larger_error.hpp"
#include "distance_map.hpp"
#include "map/reference_iteration.hpp"
#include "map_checks.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/field.hpp"
#include "random_maps.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

Map factors_map() {
  Map map = test::random_map(37, 0.05, 0.4, 71);
  for (Factor& factor : map.dynamics.factors) factor.center.w *= 5;
  map.dynamics.phase = {0.5, -0.5, 0.5, 0.5};
  return map;
}

std::vector<Quaternion> query_points(double reach, std::size_t count) {
  return test::random_points(72, count, reach, 0.4 * reach);
}

/// Of many errors, one that only a few in a hundred exceed: where orbits are unsteady, an iterate
/// multiplies what rounding did before it.
double usual_worst(std::vector<double> errors) {
  for (double& e : errors) e = std::isfinite(e) ? e : 1e9;
  std::ranges::sort(errors);
  return errors[errors.size() * 97 / 100];
}

}  // namespace

TEST_CASE("the field, the image and the number of iterates agree in single precision too") {
  const Map map = factors_map();
  const Field field(test::shared_device(), map);
  const auto points = query_points(1.5, 500);
  const auto counts = field.escape_counts_at(points, 6);
  const auto orbits = field.orbits_at(points, 6);
  const auto values = field.at(points, 6);
  std::vector<double> errors;
  std::size_t differing = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    int inside = 0;
    while (inside < 6 && norm(orbits[i * 7 + static_cast<std::size_t>(inside)]) < kUsualEscape) {
      ++inside;
    }
    differing += inside != counts[i] ? 1U : 0U;
    errors.push_back(std::abs(std::log(norm(orbits[i * 7 + 6])) - values[i]));
  }
  CHECK(differing <= 2);
  CHECK(usual_worst(errors) < 1e-2);
}

TEST_CASE("a gradient along many iterates neither overflows nor vanishes on the way") {
  // F_16 of the ball's map, q²: 2^16 ln |q|.
  const auto precision = GENERATE(Precision::single, Precision::dbl);
  if (!test::can_check(test::shared_device(), precision)) return;
  const Field field(test::shared_device(), quadratic_map({}), precision);
  const std::vector<Quaternion> points{{0.6, 0, 0.8, 0}, {0.3, 0.4, 0, 0}, {0.5, 0.5, 0.5, 0.5001}};
  const auto gradients = field.gradient_at(points, kMostIterations);
  const auto counts = field.escape_counts_at(points, kMostIterations);
  CHECK(counts[0] == kMostIterations);
  CHECK(norm(gradients[0]) == Catch::Approx(std::exp2(16)).epsilon(0.02));
  CHECK(norm(gradients[2]) == Catch::Approx(std::exp2(counts[2]) / norm(points[2])).epsilon(0.02));
  for (const Quaternion& g : gradients) CHECK(std::isfinite(norm(g)));
}

TEST_CASE("an orbit's point far out has the norm that its field says") {
  Map map;
  map.dynamics.log_scale = 60;
  map.dynamics.factors = {{{0, 0, 0, 0}, 1}};
  const auto precision = GENERATE(Precision::single, Precision::dbl);
  if (!test::can_check(test::shared_device(), precision)) return;
  const Field field(test::shared_device(), map, precision);
  const std::vector<Quaternion> points{{0, 2, 0, 0}};
  CHECK(norm(field.images_at(points).front()) == Catch::Approx(2 * std::exp(60)).epsilon(1e-4));
}

TEST_CASE("points that cannot be evaluated are refused by number, and none give nothing") {
  const Field field(test::shared_device(), factors_map());
  std::vector<Quaternion> points(5);
  using Call = std::function<std::size_t(std::span<const Quaternion>)>;
  const std::vector<Call> calls{[&](auto p) { return field.at(p, 2).size(); },
                                [&](auto p) { return field.decided_at(p, 2).size(); },
                                [&](auto p) { return field.versors_at(p).size(); },
                                [&](auto p) { return field.images_at(p, 2).size(); },
                                [&](auto p) { return field.orbits_at(p, 2).size(); },
                                [&](auto p) { return field.escape_counts_at(p, 2).size(); },
                                [&](auto p) { return field.gradient_at(p, 2).size(); },
                                [&](auto p) { return field.gradient_at(p).size(); }};
  for (const Call& call : calls) {
    CHECK(call({}) == 0);
    CHECK(call(points) >= 5);
    for (const double x :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
      points[3] = {0, x, 0, 0};
      CHECK_THROWS_AS(call(points), InputError);
      CHECK_THROWS_WITH(call(points), Catch::Matchers::ContainsSubstring("point 3 is not finite"));
    }
    points[3] = {0, 0, 0, -1e16};
    CHECK_THROWS_WITH(call(points), Catch::Matchers::ContainsSubstring("point 3 is too far away"));
    points[3] = {};
  }
}

TEST_CASE("no kernel is launched for iterations out of range or for no points") {
  const Device device = test::shared_device().sibling();
  const Field field(device, factors_map());
  device.reset_kernel_times();
  for (const int n : {0, -1, 17}) {
    CHECK_THROWS_AS(field.at(std::vector<Quaternion>(3), n), OptionError);
    CHECK_THROWS_AS(field.gradient_at(std::vector<Quaternion>(3), n), OptionError);
  }
  CHECK(field.orbits_at({}, 3).empty());
  CHECK(field.gradient_at({}, 3).empty());
  CHECK(device.kernel_times().empty());
}
