// F_n and ∂F_1/∂q on the device against the reference, at each lane width and precision.

#include <catch2/catch_all.hpp>
#include <cmath>

#include "map/reference_iteration.hpp"
#include "map_checks.hpp"
#include "qjulia/map/field.hpp"
#include "random_maps.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

constexpr double kEscape = 20;

Map general_map() {
  Map map = test::random_map(37, 0.05, 0.4, 51);
  for (std::size_t k = 0; k < map.dynamics.factors.size(); ++k) {
    map.dynamics.factors[k].center.w *= 5;  // well out of the slice
  }
  map.dynamics.phase = {0.5, -0.5, 0.5, 0.5};
  return map;
}

std::vector<Quaternion> points_in(double reach, std::size_t count) {
  return test::random_points(52, count, reach, reach);
}

}  // namespace

TEST_CASE("F_n in double is the reference's") {
  const int width = GENERATE(from_range(test::lane_widths()));
  if (!test::can_check(test::shared_device(), Precision::dbl)) return;
  const Map map = general_map();
  const Field field(test::shared_device().with_lane_width(width), map, Precision::dbl);
  // 1001 is no multiple of a width: the padding must not show.
  const auto points = points_in(1.5, 1001);
  for (const int n : {1, 2, 3, 4}) {
    CAPTURE(width, n);
    CHECK(test::sorted_errors(field, map, points, n).back() < 1e-10);
  }
}

TEST_CASE("F_n in float is the reference's within rounding, which iteration amplifies") {
  const int width = GENERATE(from_range(test::lane_widths()));
  const Map map = general_map();
  const Field field(test::shared_device().with_lane_width(width), map, Precision::single);
  const auto points = points_in(1.5, 1001);
  for (const int n : {1, 2, 3, 4}) {
    const auto error = test::sorted_errors(field, map, points, n);
    CAPTURE(width, n, error.back());
    // Each iterate multiplies what the ones before left by the map's derivative, so the worst
    // point grows; the median stays near rounding.
    CHECK(error[error.size() / 2] < 2e-6);
    CHECK(error[error.size() * 99 / 100] < 1e-6 * std::pow(10, n - 1));
    if (n == 1) CHECK(error.back() < 5e-6);
  }
}

TEST_CASE("above the level F is steeper, and one time as steep is the same field bit for bit") {
  const int width = GENERATE(from_range(test::lane_widths()));
  const auto precision = GENERATE(Precision::single, Precision::dbl);
  if (!test::can_check(test::shared_device(), precision)) return;
  const Device device = test::shared_device().with_lane_width(width);
  Map map = general_map();
  const auto points = points_in(1.5, 1001);
  map.dynamics.surface_level = 0.2;
  map.layers.steepness = 2.5;
  const Field field(device, map, precision);
  for (const int n : {1, 2, 3}) {
    const auto error = test::sorted_errors(field, map, points, n);
    CAPTURE(width, n, error.back());
    CHECK(error[error.size() / 2] < 5e-6);
    CHECK(error[error.size() * 99 / 100] < 5e-6 * std::pow(25, n - 1));
  }
  const auto steep = field.at(points);
  const auto slopes = field.gradient_at(points);
  map.layers.steepness = 1;
  const auto plain = Field(device, map, precision).at(points);
  const auto plain_slopes = Field(device, map, precision).gradient_at(points);
  map.dynamics.surface_level = 0;
  CHECK(Field(device, map, precision).at(points, 3) ==
        Field(device, general_map(), precision).at(points, 3));
  std::size_t above = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool outside = plain[i] > 0.2;
    above += outside ? 1U : 0U;
    CHECK(steep[i] ==
          Catch::Approx(outside ? 0.2 + 2.5 * (plain[i] - 0.2) : plain[i]).epsilon(1e-5));
    CHECK(norm(slopes[i]) ==
          Catch::Approx((outside ? 2.5 : 1) * norm(plain_slopes[i])).epsilon(1e-5));
  }
  CHECK(above > points.size() / 10);
  CHECK(above < points.size() * 9 / 10);
}

TEST_CASE("far away F_1 is S + degree ln |q|, and starts beyond the escape radius do not iterate") {
  const int width = GENERATE(from_range(test::lane_widths()));
  const auto precision = GENERATE(Precision::single, Precision::dbl);
  if (!test::can_check(test::shared_device(), precision)) return;
  const Map map = general_map();
  const Field far(test::shared_device().with_lane_width(width), map, precision, {0, 0, 1e9});
  const Field near(test::shared_device().with_lane_width(width), map, precision);
  const std::vector<Quaternion> points{{1e6, 0, 0, 0}, {0, -1e6, 1e6, 0}, {0, 0, 0, 21}};
  const auto f = far.at(points, 1);
  const auto stopped = near.at(points, 4);
  for (std::size_t i = 0; i < 2; ++i) {
    CHECK(f[i] ==
          Catch::Approx(map.dynamics.log_scale + map.dynamics.degree() * std::log(norm(points[i])))
              .epsilon(1e-5));
  }
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(stopped[i] == Catch::Approx(std::log(norm(points[i]))).epsilon(1e-6));
  }
}

TEST_CASE("at a centre a root is far inside and a pole far outside, and nothing is NaN") {
  const int width = GENERATE(from_range(test::lane_widths()));
  const auto precision = GENERATE(Precision::single, Precision::dbl);
  if (!test::can_check(test::shared_device(), precision)) return;
  Map map = general_map();
  // Centres that float holds exactly.
  map.dynamics.factors[0] = {{0.25, -0.5, 0.125, 0}, 2};
  map.dynamics.factors[1] = {{-0.75, 0.5, 0.25, 0}, -2};
  const Field field(test::shared_device().with_lane_width(width), map, precision);
  const std::vector<Quaternion> points{map.dynamics.factors[0].center,
                                       map.dynamics.factors[1].center};
  for (const int n : {1, 2, 3, 4}) {
    CAPTURE(width, n);
    const auto f = field.at(points, n);
    CHECK(std::isfinite(f[0]));
    CHECK(f[1] > 30);
    if (n == 1) CHECK(f[0] < -30);
    // From a root the orbit goes on at the origin.
    const std::vector<Quaternion> origin{{}};
    if (n > 1) {
      CHECK(f[0] == Catch::Approx(reference::field(map, origin, n - 1, kEscape)[0]).margin(1e-4));
    }
  }
}

TEST_CASE("beside the branch cut both sides are the reference's; on it the direction is i") {
  const int width = GENERATE(from_range(test::lane_widths()));
  const auto precision = GENERATE(Precision::single, Precision::dbl);
  if (!test::can_check(test::shared_device(), precision)) return;
  const auto device = test::shared_device().with_lane_width(width);
  // On the negative real axis of every centre; a t = 0.5 pi and 0.7 pi: nothing cancels there.
  Map map;
  map.dynamics.log_scale = -0.2;
  map.dynamics.factors = {{{0.5, 0, 0, 0}, 0.5}, {{0.75, 0, 0, 0}, 0.7}};
  const Field field(device, map, precision);
  std::vector<Quaternion> points;
  for (const double side : {0.0, 1e-6, -1e-6, 1e-4, -1e-4}) {
    points.push_back({-0.5, side, 0, 0});
    points.push_back({-0.5, 0, side, 0});
    points.push_back({-0.5, side, side, -side});
  }
  for (const int n : {1, 2, 3, 4}) {
    CAPTURE(width, n);
    CHECK(test::sorted_errors(field, map, points, n).back() <
          (precision == Precision::dbl ? 1e-10 : 2e-5));
  }
}

TEST_CASE("the gradient by the point is the reference's central difference") {
  const int width = GENERATE(from_range(test::lane_widths()));
  const auto precision = GENERATE(Precision::single, Precision::dbl);
  if (!test::can_check(test::shared_device(), precision)) return;
  const Map map = general_map();
  const Field field(test::shared_device().with_lane_width(width), map, precision);
  const auto points = points_in(1.5, 77);
  const double worst = test::sorted_gradient_errors(field, map, points, 1e-6).back();
  CAPTURE(width, worst);
  CHECK(worst < (precision == Precision::dbl ? 1e-8 : 1e-5));
}
