// Calibration, the shell and the radii that end orbits, on a body with thin arms.

#include <catch2/catch_all.hpp>
#include <cmath>

#include "armed_ball.hpp"
#include "map/reference_iteration.hpp"
#include "map/sphere_directions.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/base/progress.hpp"
#include "qjulia/map/detail.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

Map fitted(double detail) {
  static const Map plain = test::armed_ball_map(160);
  static const auto surface = test::armed_ball_surface(2000);
  return calibrated(
      test::shared_device(),
      with_detail(with_measured_detail(test::shared_device(), plain, surface), detail));
}

/// A map whose F_1 is `exponent` ln |q − c| + S.
Map one_root(const Quaternion& center, double exponent, double log_scale) {
  Map map;
  map.dynamics.factors = {{center, exponent}};
  map.dynamics.log_scale = log_scale;
  return map;
}

}  // namespace

TEST_CASE("directions are unit and evenly spread") {
  const auto directions = map::sphere_directions(4096);
  Quaternion mean;
  Quaternion squares;
  for (const Quaternion& u : directions) {
    CHECK(norm(u) == Catch::Approx(1).epsilon(1e-12));
    mean = mean + (1.0 / 4096) * u;
    squares = squares + (1.0 / 4096) * Quaternion{u.x * u.x, u.y * u.y, u.z * u.z, u.w * u.w};
  }
  CHECK(norm(mean) < 6e-3);  // random ones: about 16e-3
  for (const double s : {squares.x, squares.y, squares.z, squares.w}) {
    CHECK(s == Catch::Approx(0.25).margin(2e-3));
  }
}

TEST_CASE("the effective radius of a round potential is where it crosses the level") {
  const Field round(test::shared_device(), one_root({0, 0, 0, 0}, 3, -3 * std::log(0.6)));
  CHECK(effective_radius(round, 0, 5) == Catch::Approx(0.6).epsilon(1e-5));
  CHECK(effective_radius(round, 3 * std::log(2.0), 5) == Catch::Approx(1.2).epsilon(1e-5));
  CHECK(effective_radius(round, 100, 5) == Catch::Approx(5));  // no crossing
  // A sphere about c seen from the origin: the median direction is at right angles to c.
  const Field shifted(test::shared_device(), one_root({0.3, 0, 0, 0}, 3, 0));
  CHECK(effective_radius(shifted, 0, 5) == Catch::Approx(std::sqrt(1 - 0.09)).epsilon(2e-3));
}

TEST_CASE("calibration shifts the scale and the level by ln r_eff, and only once") {
  const Map map = with_detail(with_measured_detail(test::shared_device(), test::armed_ball_map(160),
                                                   test::armed_ball_surface(2000)),
                              0.02);
  const double radius = effective_radius(Field(test::shared_device(), map), 0, 5);
  const Map once = calibrated(test::shared_device(), map);
  CHECK(once.dynamics.surface_level == Catch::Approx(std::log(radius)).epsilon(1e-4));
  CHECK(once.dynamics.log_scale - map.dynamics.log_scale ==
        Catch::Approx(std::log(radius)).epsilon(1e-4));
  CHECK(radius > 0.7);
  CHECK(radius < 1.0);
  const Map twice = calibrated(test::shared_device(), once);
  CHECK(twice.dynamics.log_scale == Catch::Approx(once.dynamics.log_scale).epsilon(1e-5));
  CHECK(twice.dynamics.surface_level == Catch::Approx(once.dynamics.surface_level).epsilon(1e-4));
  // A root away from the origin: F_1(0) = 0 is above the level.
  CHECK_THROWS_AS(calibrated(test::shared_device(), one_root({1, 0, 0, 0}, 2, 0.5)), InputError);
}

TEST_CASE("the shell is as thick as asked") {
  const auto surface = test::armed_ball_surface(2000);
  for (const double detail : {0.005, 0.02, 0.04}) {
    const Map map = fitted(detail);
    const double diagonal = map.frame.box->diagonal();
    CHECK(shell_thickness(Field(test::shared_device(), map), surface, 0) ==
          Catch::Approx(detail * diagonal).epsilon(1e-4));
    CHECK(map.frame.detail == detail);
  }
  // |∇F_1| of 2 ln |q| on the unit sphere is 2.
  std::vector<Eigen::Vector3d> sphere;
  for (const Quaternion& u : map::sphere_directions(100)) {
    sphere.push_back(Eigen::Vector3d(u.x, u.y, u.z).normalized());
  }
  CHECK(shell_thickness(Field(test::shared_device(), one_root({}, 2, 0)), sphere, 0) ==
        Catch::Approx(0.5));
  CHECK(median_level(Field(test::shared_device(), one_root({}, 2, 0.25)), sphere, 0) ==
        Catch::Approx(0.25));
}

TEST_CASE("the stop radii of a square are just within and beyond 1") {
  const StopRadii stops = find_stop_radii(test::shared_device(), one_root({}, 2, 0));
  CHECK(stops.inner > 0.94);
  CHECK(stops.inner < 1);
  CHECK(stops.outer >= 1);
  CHECK(stops.outer < 1.05);
  CHECK(stops.escape == Catch::Approx(1.25 * stops.outer));
}

TEST_CASE("r_in of a power is the radius that its margin leaves") {
  // a ln r = ln(0.98 r).
  const double exponent = GENERATE(1.3, 1.7, 2.0, 3.0, 5.0);
  const double expected = std::pow(0.98, 1 / (exponent - 1));
  const double inner = find_stop_radii(test::shared_device(), one_root({}, exponent, 0)).inner;
  CHECK(inner <= 1.0001 * expected);
  CHECK(inner > 0.999 * expected);
}

TEST_CASE("r_out is found where the certain bound lies far beyond the default escape radius") {
  // A dipole: ± 60 ln |q| all but cancel, which a bound that knows only |c_k| cannot see.
  Map map = one_root({}, 1.3, 0.1);
  map.dynamics.factors.push_back({{1, 0, 0, 0}, 60});
  map.dynamics.factors.push_back({{1, 0.01, 0, 0}, -60});
  const StopRadii stops = find_stop_radii(test::shared_device(), map);
  CHECK(stops.outer < 4);
  for (const Quaternion& u : map::sphere_directions(500)) {
    const std::vector<Quaternion> beyond{1.001 * stops.outer * u};
    CHECK(std::exp(reference::field(map, beyond, 1, 1e9)[0]) > 1.001 * stops.outer);
  }
}

TEST_CASE("no orbit leaves r_in or returns from r_out") {
  const double detail = GENERATE(0.005, 0.02, 0.04);
  const Map map = fitted(detail);
  const StopRadii stops = find_stop_radii(test::shared_device(), map);
  CAPTURE(detail, stops.inner, stops.outer);
  CHECK(stops.inner > 0.3);
  CHECK(stops.outer < 2.2);  // the farthest tip is at 1.64
  const auto directions = map::sphere_directions(3001);
  // Inside, one image is enough: the ball maps into itself.
  for (const double part : {1.0, 0.97, 0.8, 0.3}) {
    std::vector<Quaternion> ball;
    for (const Quaternion& u : directions) ball.push_back(part * stops.inner * u);
    const auto f = reference::field(map, ball, 1, 1e9);
    CHECK(std::exp(*std::ranges::max_element(f)) <= stops.inner);
  }
  // Outside every image is farther out.
  for (const double part : {1.0, 1.005, 1.02, 1.1, 1.5, 4.0}) {
    std::vector<Quaternion> shell;
    for (const Quaternion& u : directions) shell.push_back(part * stops.outer * u);
    const auto f = reference::field(map, shell, 1, 1e9);
    CHECK(std::exp(*std::ranges::min_element(f)) > part * stops.outer);
  }
  // Whole orbits of points about the surface: each side once reached is kept.
  int left = 0;
  int returned = 0;
  for (const auto& x : test::armed_ball_surface(400)) {
    Quaternion q{x.x(), x.y(), x.z(), 0};
    bool inside = false;
    bool outside = false;
    for (int i = 0; i < 12 && norm(q) < 1e6; ++i) {
      const auto [log_norm, versor] = reference::step(map, q);
      q = std::exp(log_norm) * versor;
      left += inside && norm(q) > stops.inner ? 1 : 0;
      returned += outside && norm(q) < stops.outer ? 1 : 0;
      inside = inside || norm(q) < stops.inner;
      outside = outside || norm(q) > stops.outer;
    }
  }
  CHECK(left == 0);
  CHECK(returned == 0);
}

TEST_CASE("stopping at the radii changes no side") {
  const Map map = fitted(0.03);
  const StopRadii stops = find_stop_radii(test::shared_device(), map);
  const Precision precision =
      test::can_check(test::shared_device(), Precision::dbl) ? Precision::dbl : Precision::single;
  const Field field(test::shared_device(), map, precision, stops);
  std::vector<Quaternion> points;
  for (const auto& x : test::armed_ball_surface(3000)) points.push_back({x.x(), x.y(), x.z(), 0});
  for (const int n : {1, 2, 6}) {
    const auto full = field.at(points, n);
    const auto decided = field.decided_at(points, n);
    std::size_t differ = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      differ += (full[i] < map.dynamics.surface_level) != (decided[i] < map.dynamics.surface_level)
                    ? 1U
                    : 0U;
    }
    CAPTURE(n);
    CHECK(differ == 0);
  }
}

TEST_CASE("a map that does not grow outwards has no r_out") {
  const StopRadii stops = find_stop_radii(test::shared_device(), one_root({}, 0.9, -1));
  CHECK(std::isinf(stops.outer));
  CHECK(stops.escape == 20);
  Map high = one_root({}, 0.9, -1);
  high.dynamics.surface_level = 4;
  CHECK(find_stop_radii(test::shared_device(), high).escape == Catch::Approx(1.25 * std::exp(4)));
}

TEST_CASE("r_in is below e^L and r_out above it") {
  // The ball of radius 1 maps into itself, and beyond it orbits leave.
  Map map = one_root({}, 2, 0);
  map.dynamics.surface_level = std::log(0.5);
  CHECK(find_stop_radii(test::shared_device(), map).inner == Catch::Approx(0.5).epsilon(1e-4));
  CHECK(find_stop_radii(test::shared_device(), map).inner < 0.5);
  map.dynamics.surface_level = std::log(3);
  CHECK(find_stop_radii(test::shared_device(), map).outer == Catch::Approx(3).epsilon(1e-4));
  CHECK(find_stop_radii(test::shared_device(), map).outer > 3);
}

TEST_CASE("factors in many equal parts have the radii of the whole ones") {
  const Map whole = fitted(0.02);
  Map parts = whole;
  constexpr int kParts = 40;  // 6,400 factors: more than have directions of their own
  parts.dynamics.factors.clear();
  for (const Factor& factor : whole.dynamics.factors) {
    parts.dynamics.factors.insert(parts.dynamics.factors.end(), kParts,
                                  {factor.center, factor.exponent / kParts});
  }
  const StopRadii expected = find_stop_radii(test::shared_device(), whole);
  const StopRadii found = find_stop_radii(test::shared_device(), parts);
  CHECK(found.inner == Catch::Approx(expected.inner).epsilon(0.01));
  CHECK(found.outer == Catch::Approx(expected.outer).epsilon(0.01));
}

TEST_CASE("the search for radii hears a stop") {
  std::stop_source source;
  source.request_stop();
  CHECK_THROWS_AS(find_stop_radii(test::shared_device(), fitted(0.02), {}, source.get_token()),
                  Interrupted);
}
