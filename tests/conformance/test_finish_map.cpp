// From a map in distance units to the one a user gets, on a ball, where all is known.

#include <Eigen/LU>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <numbers>
#include <stop_token>

#include "base/random.hpp"
#include "fit/far_field.hpp"
#include "fit/finish_map.hpp"
#include "fit/sample_pool.hpp"
#include "map/reference_iteration.hpp"
#include "qjulia/base/error.hpp"
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

Map finished(const Map& map, double detail, std::vector<std::string>& warnings) {
  return fitting::finish_map(test::shared_device(), map, ball().shape, ball().pool, detail,
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
  return reference::field(map, std::vector{q}, 1, 1e6).front();
}

}  // namespace

TEST_CASE("a finished map has the wanted shell, its level and scale, and the shape's coordinates") {
  std::vector<std::string> warnings;
  const double detail = GENERATE(0.01, 0.03);
  const Map map = finished(in_distance_units(), detail, warnings);
  CHECK(warnings.empty());
  REQUIRE(map.frame.detail.has_value());
  CHECK(*map.frame.detail == Catch::Approx(detail));
  // The shell is δ of the diagonal of the ball's box thick: slope a / r₀ = 1 / (δ 2 √3 r₀).
  const double exponent = 1 / (detail * 2 * std::numbers::sqrt3);
  CHECK(map.dynamics.factors.front().exponent == Catch::Approx(exponent).epsilon(2e-3));
  // Calibrated: the set reaches to the surface, where F_1 is ln r₀.
  CHECK(map.dynamics.surface_level == Catch::Approx(std::log(kRadius)).margin(5e-3));
  CHECK(potential_at(map, {kRadius, 0, 0, 0}) ==
        Catch::Approx(map.dynamics.surface_level).margin(0.02));
  CHECK(*map.frame.inradius == Catch::Approx(4).epsilon(5e-3));
  CHECK(map.frame.box->center().x() == Catch::Approx(10));
  CHECK(map.frame.shape_to_map.to_map({10, 4, 0}).isApprox(Eigen::Vector3d(0, kRadius, 0), 1e-3));
}

TEST_CASE(
    "what was finished and polished since gets its shell's thickness back, and nothing else") {
  std::vector<std::string> warnings;
  const Map map = finished(in_distance_units(), 0.02, warnings);
  Map polished = map;
  polished.dynamics.factors.front().exponent *= 1.3;
  const Map back = finished(polished, 0.02, warnings);
  CHECK(warnings.empty());
  CHECK(back.dynamics.factors.front().exponent ==
        Catch::Approx(map.dynamics.factors.front().exponent));
  CHECK(back.frame.shape_to_map.scale == map.frame.shape_to_map.scale);
  CHECK(*back.frame.detail == Catch::Approx(0.02));
}

TEST_CASE("warnings say what is wrong with the map, and where") {
  std::vector<std::string> warnings;
  // A poor fit: the surface is missed about (16, 0, 0), or the far side.
  Map off = in_distance_units();
  off.dynamics.factors.front().center.x = 0.3;
  Map poor = finished(off, 0.02, warnings);
  CHECK(warnings.empty());
  const auto said = [&](double iou) {
    return fitting::poor_fit(test::shared_device(), poor, iou, ball().pool);
  };
  CHECK_THAT(said(0.5), Catch::Matchers::ContainsSubstring("IoU of 0.50") &&
                            Catch::Matchers::ContainsSubstring("near (14, "));
  CHECK(said(0.95).empty());
  const std::string plain = said(0.5);
  poor.layers.steepness = 4;  // the field is steeper outside; the surface stays
  CHECK(said(0.5) == plain);

  // A pole where the deepest point is: no calibration.
  warnings.clear();
  Map outside;
  outside.dynamics.factors = {{{0, 0, 0, 0}, -1}, {{2, 0, 0, 0}, 1.5}, {{-2, 0, 0, 0}, 1.5}};
  const Map uncalibrated = finished(outside, 0.02, warnings);
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings.front(),
             Catch::Matchers::ContainsSubstring("does not hold the shape's deepest point inside"));
  CHECK(uncalibrated.dynamics.surface_level == 0);

  // A thick shell about an origin that is not deep.
  warnings.clear();
  Map shallow;
  shallow.dynamics.factors = {{{1, 0, 0, 0}, kRadius / 2}, {{-1, 0, 0, 0}, kRadius / 2}};
  finished(shallow, 0.1, warnings);
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings.front(), Catch::Matchers::ContainsSubstring("near dissolving"));
}

TEST_CASE("a shell that leaves the set unbounded is made thinner, and no fit is lost by it") {
  std::vector<std::string> warnings;
  // The slope r₀ / r₀ = 1 makes δ = 1 / (2 √3 r₀) of the diagonal, with an exponent of r₀.
  const double most = kRadius / (2 * std::numbers::sqrt3 * kRadius);
  const Map thick = finished(in_distance_units(), 1.5 * most, warnings);
  CHECK(thick.dynamics.degree() == Catch::Approx(1.1));
  CHECK(*thick.frame.detail == Catch::Approx(most / 1.1).epsilon(2e-3));
}

TEST_CASE("exponents whose sum bounds no set are given one that does, and the shape stays") {
  std::vector<std::string> warnings;
  Map repelling = in_distance_units();
  const bool has_far_root = GENERATE(false, true);
  repelling.dynamics.factors.push_back({{60, 0, 0, 0}, -2 * kRadius});
  if (has_far_root) repelling.dynamics.factors.push_back({{0, 0, 0, 90}, 0.4});
  const Map bounded = finished(repelling, 0.02, warnings);
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings.front(), Catch::Matchers::ContainsSubstring("its exponents were changed"));
  CHECK(*bounded.frame.detail == Catch::Approx(0.02));
  CHECK(bounded.dynamics.factors.size() == 2);
  CHECK(bounded.dynamics.degree() > 1);
  const double level = bounded.dynamics.surface_level;
  for (const double x : {-kRadius, kRadius}) {
    CHECK(potential_at(bounded, {0.9 * x, 0, 0, 0}) < level);
    CHECK(potential_at(bounded, {1.1 * x, 0, 0, 0}) > level);
  }
  // 2 √3 r₀ is twice as far as the corners of the ball's box.
  for (const double distance : {2 * std::numbers::sqrt3 * kRadius, 20.0, 1e3}) {
    CHECK(potential_at(bounded, {0, distance, 0, 0}) > std::log(distance));
    CHECK(potential_at(bounded, {-distance, 0, 0, 0}) > std::log(distance));
  }
}

TEST_CASE("a field that no sum of exponents makes rise outside the shape gives a warning") {
  std::vector<std::string> warnings;
  // About its only root, at nearly twice the distance of the box's corners, points return.
  Map flat;
  flat.dynamics.factors = {{{0, 0, 0, 3 * kRadius}, 1.5}};
  finished(flat, 0.02, warnings);
  CHECK(std::ranges::any_of(warnings, [](const std::string& warning) {
    return warning.find("rises too little outside the shape") != std::string::npos;
  }));
}

TEST_CASE("a raised degree changes exponents as the definition says") {
  base::Random random(3);
  const auto number = [&](double low, double high) { return random.uniform(low, high); };
  Map map;
  map.frame.box = Box{{-1, -1, -1}, {1, 1, 0.5}};
  map.dynamics.log_scale = 0.3;
  for (int k = 0; k < 5; ++k) {
    map.dynamics.factors.push_back(
        {{number(-1, 1), number(-1, 1), number(-1, 1), number(0.1, 1)}, number(-1, 2)});
  }
  Map given = map;
  const Factor far{{0, 0, 5, 0}, 0.7};
  given.dynamics.factors.insert(given.dynamics.factors.begin() + 2, far);
  std::vector<Eigen::Vector3d> points(30);
  for (Eigen::Vector3d& p : points) p = {number(-2, 2), number(-2, 2), number(-2, 2)};
  CHECK(fitting::far_from_shape(given.frame) == Catch::Approx(2 * std::sqrt(3.0)));
  const Map raised = fitting::with_raised_degree(given, points, 6.5);
  REQUIRE(raised.dynamics.factors.size() == 5);
  CHECK(raised.dynamics.degree() == Catch::Approx(6.5));

  // The least of |A b - r|² + λ |b|² with Σ b given, by Lagrange's multiplier.
  const auto logarithms_of = [&](const Factor& factor) {
    Eigen::VectorXd found(points.size());
    for (std::size_t p = 0; p < points.size(); ++p) {
      const Quaternion d =
          Quaternion{points[p].x(), points[p].y(), points[p].z(), 0} - factor.center;
      found[static_cast<Eigen::Index>(p)] = std::log(norm(d));
    }
    found.array() -= found.mean();
    return found;
  };
  Eigen::MatrixXd a(points.size(), 5);
  for (int k = 0; k < 5; ++k) {
    a.col(k) = logarithms_of(map.dynamics.factors[static_cast<std::size_t>(k)]);
  }
  Eigen::MatrixXd system = Eigen::MatrixXd::Ones(6, 6);
  system.topLeftCorner(5, 5) =
      a.transpose() * a + 0.01 * a.squaredNorm() / 5 * Eigen::MatrixXd::Identity(5, 5);
  system(5, 5) = 0;
  Eigen::VectorXd right(6);
  right << a.transpose() * logarithms_of(far) * far.exponent, 6.5 - map.dynamics.degree();
  const Eigen::VectorXd change = system.lu().solve(right);
  double before = 0, after = 0;
  for (int k = 0; k < 5; ++k) {
    const auto i = static_cast<std::size_t>(k);
    CHECK(raised.dynamics.factors[i].exponent ==
          Catch::Approx(map.dynamics.factors[i].exponent + change[k]));
  }
  for (const Eigen::Vector3d& p : points) {
    const Quaternion q{p.x(), p.y(), p.z(), 0};
    before += potential_at(given, q), after += potential_at(raised, q);
  }
  CHECK(after == Catch::Approx(before));

  CHECK_THROWS_AS(fitting::with_raised_degree(given, {}, 6.5), InputError);
  map.dynamics.factors = {far, far};
  const Map all_far = fitting::with_raised_degree(map, points, 6.5);
  CHECK(all_far.dynamics.factors.size() == 2);
  CHECK(all_far.dynamics.degree() == Catch::Approx(6.5));
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
