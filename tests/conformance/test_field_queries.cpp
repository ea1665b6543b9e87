// Versors, orbits and gradients at points, for maps of every kind, against the reference.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/larger_error.hpp"
#include "distance_map.hpp"
#include "map/reference_iteration.hpp"
#include "map_checks.hpp"
#include "qjulia/error.hpp"
#include "qjulia/field.hpp"
#include "random_maps.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

struct MapKind {
  std::string name;
  Map map;
  /// Whether the reference has derivatives of all of it.
  bool is_smooth = true;
};

std::ostream& operator<<(std::ostream& out, const MapKind& kind) { return out << kind.name; }

Map factors_map() {
  Map map = test::random_map(37, 0.05, 0.4, 71);
  for (Factor& factor : map.dynamics.factors) factor.center.w *= 5;
  map.dynamics.phase = {0.5, -0.5, 0.5, 0.5};
  return map;
}

Map with_portals(Map map) {
  map.layers.portals = {{{0.9, 0.2, 0.1}, 0.5, 2.5, {{0, 1, 1}, 50}, {0.1, 0, 0}, PortalMask::none},
                        {{-0.8, -0.1, 0.4}, 0.45, 3, {}, {0, 0, 0}, PortalMask::outside}};
  return map;
}

Map with_paint(Map map) {
  Paint paint;
  paint.cells = {14, 11, 9};
  paint.origin = {-1.9, -1.2, -1.05};
  paint.step = 0.23;
  for (std::size_t i = 0; i < paint.size(); ++i) {
    paint.shares.push_back(static_cast<std::uint8_t>(255 - (i * i * 37 + 11 * i) % 200));
  }
  map.layers.paint = paint;
  return map;
}

Map noisy_map(NoiseValues values) {
  Map map = test::distance_map(0.4);
  map.dynamics.factors.clear();
  map.dynamics.versor = NoiseVersor{3, 1.3, 3000000019U, values, {0.1, -0.2, 0.05}};
  map.dynamics.phase = {0.8, 0, 0.6, 0};
  return map;
}

std::vector<MapKind> map_kinds() {
  Map steep = factors_map();
  steep.layers.steepness = 2.5;
  steep.dynamics.surface_level = 0.2;
  Map quadratic = quadratic_map({-0.2, 0.6, 0.2, 0.1});
  quadratic.dynamics.phase = {0.6, 0, 0.8, 0};
  return {{"factors", factors_map()},
          {"steep", steep},
          {"quadratic", quadratic},
          {"distance", test::distance_map(0.4)},
          {"noise vectors", noisy_map(NoiseValues::vectors), false},
          {"noise quaternions", noisy_map(NoiseValues::quaternions), false},
          {"portals", with_portals(factors_map())},
          {"portals in noise", with_portals(noisy_map(NoiseValues::vectors)), false},
          {"paint", with_paint(factors_map())},
          {"painted distance", with_paint(test::distance_map(0.4))}};
}

std::vector<Quaternion> query_points(double reach, std::size_t count) {
  return test::random_points(72, count, reach, 0.4 * reach);
}

/// The points of an orbit as plain steps of the reference give them, without repetitions.
std::vector<Quaternion> reference_orbit(const Map& map, const Quaternion& start, int iterations) {
  std::vector<Quaternion> orbit{start};
  for (int j = 0; j < iterations && norm(orbit.back()) < kUsualEscape; ++j) {
    const auto [log_norm, versor] = reference::step(map, orbit.back());
    orbit.push_back(std::exp(log_norm) * versor);
  }
  return orbit;
}

double offset(const Quaternion& a, const Quaternion& b) {
  return norm(a - b) / std::max(1.0, norm(b));
}

/// Of many errors, one that only a few in a hundred exceed: where orbits are unsteady, an iterate
/// multiplies what rounding did before it.
double usual_worst(std::vector<double> errors) {
  for (double& e : errors) e = std::isfinite(e) ? e : 1e9;
  std::ranges::sort(errors);
  return errors[errors.size() * 97 / 100];
}

/// ∂F_n/∂q of the reference by central differences of fourth order.
Quaternion by_differences(const Map& map, const Quaternion& q, int iterations) {
  constexpr double kStep = 2e-5;
  const auto along = [&](const Quaternion& axis) {
    const std::vector<Quaternion> around{q + kStep * axis, q - kStep * axis, q + 2 * kStep * axis,
                                         q - 2 * kStep * axis};
    const auto f = reference::field(map, around, iterations, kUsualEscape);
    return (8 * (f[0] - f[1]) - (f[2] - f[3])) / (12 * kStep);
  };
  return {along({1, 0, 0, 0}), along({0, 1, 0, 0}), along({0, 0, 1, 0}), along({0, 0, 0, 1})};
}

}  // namespace

TEST_CASE("versors and images are the reference's for every kind of map") {
  const int width = GENERATE(from_range(test::lane_widths()));
  const auto precision = GENERATE(Precision::single, Precision::dbl);
  if (!test::checks_every_kind(width, precision)) return;
  const MapKind kind = GENERATE(from_range(map_kinds()));
  if (!test::can_check(test::shared_device(), precision)) return;
  const Field field(test::shared_device().with_lane_width(width), kind.map, precision);
  const auto points = query_points(1.4, 301);
  const auto versors = field.versors_at(points);
  const auto images = field.images_at(points);
  const auto values = field.at(points);
  std::vector<double> turned, moved;
  double unit = 0, lengths = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto [log_norm, versor] = reference::step(kind.map, points[i]);
    turned.push_back(offset(versors[i], versor));
    moved.push_back(offset(images[i], std::exp(log_norm) * versor));
    unit = base::larger_error(unit, std::abs(norm(versors[i]) - 1));
    lengths = base::larger_error(lengths, std::abs(std::log(norm(images[i])) - values[i]));
  }
  const bool twice = precision == Precision::dbl;
  CAPTURE(width, twice, kind);
  CHECK(usual_worst(turned) < (twice ? 1e-10 : 3e-5));
  CHECK(usual_worst(moved) < (twice ? 1e-10 : 3e-5));
  CHECK(unit < (twice ? 1e-12 : 1e-6));
  CHECK(lengths < (twice ? 1e-12 : 1e-5));
}

TEST_CASE("orbits are the reference's, and end where they escape") {
  const int width = GENERATE(from_range(test::lane_widths()));
  const MapKind kind = GENERATE(from_range(map_kinds()));
  if (!test::can_check(test::shared_device(), Precision::dbl)) return;
  constexpr int kIterations = 5;
  const Field field(test::shared_device().with_lane_width(width), kind.map, Precision::dbl);
  auto points = query_points(1.4, 203);
  points.push_back({0, 15, -15, 0});  // beyond the escape radius
  const auto orbits = field.orbits_at(points, kIterations);
  const auto images = field.images_at(points, kIterations);
  const auto counts = field.escape_counts_at(points, kIterations);
  const auto values = field.at(points, kIterations);
  REQUIRE(orbits.size() == points.size() * (kIterations + 1));
  CAPTURE(width, kind);
  std::vector<double> errors, lengths;
  std::size_t wrong_counts = 0, short_ones = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Quaternion* const orbit = &orbits[i * (kIterations + 1)];
    const auto expected = reference_orbit(kind.map, points[i], kIterations);
    double worst = 0;
    for (std::size_t j = 0; j <= kIterations; ++j) {
      const Quaternion& right = expected[std::min(j, expected.size() - 1)];
      worst = base::larger_error(worst, offset(orbit[j], right));
    }
    errors.push_back(worst);
    CHECK(orbit[0] == points[i]);
    CHECK(orbit[kIterations] == images[i]);
    lengths.push_back(std::abs(std::log(norm(images[i])) - values[i]));
    if (static_cast<std::size_t>(counts[i]) != expected.size() - 1) ++wrong_counts;
    if (counts[i] < kIterations) ++short_ones;
  }
  CHECK(usual_worst(errors) < 1e-6);
  CHECK(usual_worst(lengths) < 1e-9);
  CHECK(wrong_counts <= 2);
  CHECK(short_ones > 0);
  CHECK(counts.back() == 0);
  CHECK(images.back() == points.back());
}

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

TEST_CASE("gradients of F_n are the reference's for every kind of map") {
  const int width = GENERATE(from_range(test::lane_widths()));
  const auto precision = GENERATE(Precision::single, Precision::dbl);
  if (!test::checks_every_kind(width, precision)) return;
  const MapKind kind = GENERATE(from_range(map_kinds()));
  if (!test::can_check(test::shared_device(), precision)) return;
  const bool twice = precision == Precision::dbl;
  const Field field(test::shared_device().with_lane_width(width), kind.map, precision);
  auto points = query_points(1.3, 203);
  points.push_back({0, 15, -15, 0});  // whose field is ln |q|
  for (const int n : {1, 2, 3, 4}) {
    const auto found = field.gradient_at(points, n);
    std::vector<Quaternion> expected;
    if (kind.is_smooth) {
      expected = reference::point_gradients(kind.map, points, n, kUsualEscape);
    } else {
      for (const Quaternion& q : points) expected.push_back(by_differences(kind.map, q, n));
    }
    std::vector<double> errors;
    for (std::size_t i = 0; i < points.size(); ++i) {
      errors.push_back(norm(found[i] - expected[i]) / norm(expected[i]));
    }
    const double usual = usual_worst(errors);
    CAPTURE(width, twice, kind, n, usual);
    CHECK(errors.back() < 1e-6);
    if (kind.is_smooth) {
      CHECK(usual < (twice ? 1e-9 : 1e-5 * std::pow(12, n - 1)));
    } else {
      CHECK(usual < (twice ? 1e-6 : 1e-4) * std::pow(12, n - 1));
    }
    std::ranges::sort(errors);
    CHECK(errors[errors.size() / 2] < (twice ? (kind.is_smooth ? 1e-12 : 1e-8) : 1e-5 * n));
  }
}

TEST_CASE("gradients in double agree with differences of the field on the device") {
  if (!test::can_check(test::shared_device(), Precision::dbl)) return;
  const MapKind kind = GENERATE(from_range(map_kinds()));
  const Field field(test::shared_device(), kind.map, Precision::dbl);
  const auto points = query_points(1.3, 101);
  constexpr double kStep = 1e-5;
  for (const int n : {1, 3}) {
    const auto gradients = field.gradient_at(points, n);
    std::vector<double> errors(points.size());
    for (const Quaternion& axis :
         {Quaternion{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}) {
      auto up = points, down = points;
      for (Quaternion& q : up) q = q + kStep * axis;
      for (Quaternion& q : down) q = q - kStep * axis;
      const auto above = field.at(up, n), below = field.at(down, n);
      for (std::size_t i = 0; i < points.size(); ++i) {
        const double difference = (above[i] - below[i]) / (2 * kStep);
        errors[i] = base::larger_error(errors[i], std::abs(difference - dot(gradients[i], axis)) /
                                                      std::max(1.0, norm(gradients[i])));
      }
    }
    CAPTURE(kind, n);
    std::ranges::sort(errors);
    CHECK(errors[errors.size() * 8 / 10] < 1e-4);
    CHECK(errors[errors.size() / 2] < 1e-6);
  }
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
