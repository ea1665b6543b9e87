// What every kind of map does alike: a new one is listed in `map_kinds`, and is checked in every
// lane width and layout. What only one kind does is in its own file.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "base/larger_error.hpp"
#include "distance_map.hpp"
#include "lattice/level_set.hpp"
#include "map/reference_iteration.hpp"
#include "map_checks.hpp"
#include "patchy_paint.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/map/map_file.hpp"
#include "qjulia/picture/picture.hpp"
#include "random_maps.hpp"
#include "temporary_folder.hpp"
#include "test_device.hpp"

using namespace qjulia;
using Eigen::Vector3d;

namespace {

struct MapKind {
  std::string name;
  Map map;
  /// Whether the reference has derivatives of all of it.
  bool is_smooth = true;
  /// Largest error of F_1, over max(1, |F_1|), in single precision and in double.
  double single = 5e-5, dbl = 1e-9;
  /// How many times as large errors an iterate may make: about the map's derivative.
  double growth = 30;
  /// Whether bounds over cubes are of F_1 itself. In a portal they are of what decides orbits.
  bool has_bounds = true;
};

std::ostream& operator<<(std::ostream& out, const MapKind& kind) { return out << kind.name; }

Map map_of_factors() {
  Map map = test::random_map(37, 0.05, 0.4, 71);
  for (Factor& factor : map.dynamics.factors) factor.center.w *= 5;
  map.dynamics.phase = {0.5, -0.5, 0.5, 0.5};
  return map;
}

Map with_portals(Map map, PortalMask first = PortalMask::none) {
  map.layers.portals = {{{0.9, 0.2, 0.1}, 0.5, 2.5, {{0, 1, 1}, 50}, {0.1, 0, 0}, first},
                        {{-0.8, -0.1, 0.4}, 0.45, 3, {}, {0, 0, 0}, PortalMask::outside}};
  return map;
}

Map with_paint(Map map) {
  map.layers.paint = test::patchy_paint();
  return map;
}

Map flat_distance() {
  Map map = test::distance_map(0.4);
  std::get<DistanceModulus>(map.dynamics.modulus).fourth = FourthCoordinate::ignored;
  map.dynamics.phase = {0.8, 0, 0.6, 0};
  return map;
}

/// Factors for their norm, and a noise to turn them.
Map noisy_factors() {
  Map map = test::random_map(7, 0.1, 0.6, 5);
  map.dynamics.versor = NoiseVersor{1, 2.5, 7, NoiseValues::vectors, {0, 0, 0}};
  map.dynamics.phase = {0.8, 0, 0.6, 0};
  return map;
}

template <class Part>
Map with_part(Part Dynamics::*part, const auto& kind) {
  Map map = test::random_map(20, 0.1, 0.6, 5);
  map.dynamics.*part = kind;
  map.dynamics.phase = {0.8, 0, 0.6, 0};
  return map;
}

Map noisy_map(NoiseValues values) {
  Map map = test::distance_map(0.4);
  map.dynamics.factors.clear();
  map.dynamics.versor = NoiseVersor{3, 1.3, 3000000019U, values, {0.1, -0.2, 0.05}};
  map.dynamics.phase = {0.8, 0, 0.6, 0};
  return map;
}

/// The list. Each alternative of `Modulus` and `Versor` and each layer stands in it.
const std::vector<MapKind>& map_kinds() {
  static const std::vector<MapKind> kinds = [] {
    Map steep = map_of_factors();
    steep.layers.steepness = 2.5;
    steep.dynamics.surface_level = 0.2;
    const Quaternion c{-0.2, 0.6, 0.2, 0.1};
    Map quadratic = quadratic_map(c);
    quadratic.dynamics.phase = {0.6, 0, 0.8, 0};
    const auto vectors = NoiseValues::vectors, quaternions = NoiseValues::quaternions;
    return std::vector<MapKind>{
        {.name = "factors", .map = map_of_factors(), .single = 5e-6},
        {.name = "steep", .map = steep, .single = 2e-5},
        {.name = "quadratic", .map = quadratic},
        {.name = "quadratic norm", .map = with_part(&Dynamics::modulus, QuadraticModulus{c})},
        {.name = "quadratic versor", .map = with_part(&Dynamics::versor, QuadraticVersor{c})},
        {.name = "distance", .map = test::distance_map(0.4)},
        {.name = "flat distance", .map = flat_distance()},
        {.name = "noise vectors", .map = noisy_map(vectors), .is_smooth = false},
        {.name = "noise quaternions", .map = noisy_map(quaternions), .is_smooth = false},
        {.name = "noise on factors", .map = noisy_factors(), .is_smooth = false},
        {.name = "portals", .map = with_portals(map_of_factors()), .has_bounds = false},
        {.name = "inner portals",
         .map = with_portals(map_of_factors(), PortalMask::inside),
         .has_bounds = false},
        {.name = "portals in noise",
         .map = with_portals(noisy_map(vectors)),
         .is_smooth = false,
         .has_bounds = false},
        {.name = "paint", .map = with_paint(map_of_factors()), .single = 2e-3, .growth = 100},
        {.name = "painted distance",
         .map = with_paint(test::distance_map(0.4)),
         .single = 2e-3,
         .growth = 100},
        {.name = "painted noise",
         .map = with_paint(noisy_map(quaternions)),
         .is_smooth = false,
         .single = 2e-3,
         .growth = 100},
        {.name = "painted quadratic", .map = with_paint(quadratic), .single = 2e-3, .growth = 100}};
  }();
  return kinds;
}

std::vector<const MapKind*> listed_kinds() {
  std::vector<const MapKind*> kinds;
  for (const MapKind& kind : map_kinds()) kinds.push_back(&kind);
  return kinds;
}

/// All about, and as many again in portals.
std::vector<Quaternion> points_of(const MapKind& kind, double reach, std::size_t count) {
  auto points = test::random_points(72, count, reach, 0.4 * reach);
  for (const Portal& portal : kind.map.layers.portals) {
    const auto in_ball =
        test::random_points(73, count / 2, 0.6 * portal.radius, 0.1 * portal.radius, portal.center);
    points.insert(points.end(), in_ball.begin(), in_ball.end());
  }
  return points;
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
double most_below(std::vector<double> errors) {
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

TEST_CASE("every modulus, versor and layer is a listed kind") {
  std::set<std::size_t> moduli, versors;
  bool has_portals = false, has_paint = false;
  for (const MapKind& kind : map_kinds()) {
    INFO(kind.name);
    CHECK_NOTHROW(kind.map.validate());
    moduli.insert(kind.map.dynamics.modulus.index());
    versors.insert(kind.map.dynamics.versor.index());
    has_portals |= !kind.map.layers.portals.empty();
    has_paint |= kind.map.layers.paint.has_value();
  }
  CHECK(moduli.size() == std::variant_size_v<Modulus>);
  CHECK(versors.size() == std::variant_size_v<Versor>);
  CHECK((has_portals && has_paint));
}

TEST_CASE("F_n is the reference's") {
  const test::Variant variant = GENERATE(from_range(test::variants()));
  const auto precision = GENERATE(Precision::single, Precision::dbl);
  if (!test::checks_every_kind(variant, precision)) return;
  const MapKind& kind = *GENERATE(from_range(listed_kinds()));
  if (!test::can_check(test::shared_device(), precision)) return;
  const bool twice = precision == Precision::dbl;
  // 1001 is no multiple of a width: the padding must not show.
  const auto points = points_of(kind, 1.5, 1001);
  const Field field(variant.of(test::shared_device()), kind.map, precision);
  for (const int n : {1, 2, 3}) {
    const auto errors = test::sorted_errors(field, kind.map, points, n);
    CAPTURE(variant, twice, kind, n, errors.back());
    CHECK(errors[errors.size() / 2] < (twice ? 1e-9 : 1e-5));
    if (n == 1) CHECK(errors.back() < (twice ? kind.dbl : kind.single));
    // Later orbits may be at an edge, or at the set's boundary, where rounding decides.
    CHECK(errors[errors.size() * 95 / 100] < (twice ? 1e-6 : 5e-5) * std::pow(kind.growth, n - 1));
  }
}

TEST_CASE("bounds over cubes hold F_1 at every point of them") {
  const test::Variant variant = GENERATE(from_range(test::variants()));
  const MapKind& kind = *GENERATE(from_range(listed_kinds()));
  if (!kind.has_bounds) return;
  constexpr double kNever = std::numeric_limits<double>::infinity();
  Map map = kind.map;
  map.dynamics.slice = 0.1;
  const surface::LevelSet set(variant.of(test::shared_device()), map, {0, kNever, 50}, 1);
  std::mt19937_64 bits(9);
  const auto within = [&](double reach) {
    const double x = test::uniform(bits, -reach, reach), y = test::uniform(bits, -reach, reach);
    return Vector3d(x, y, test::uniform(bits, -reach, reach));
  };
  for (const double half_side : {0.01, 0.1, 0.4}) {
    std::vector<Vector3d> centers(61);  // no multiple of a width
    for (Vector3d& center : centers) center = within(2);
    const auto bounds = set.bounds(centers, half_side);
    std::size_t wrong = 0, useful = 0;
    for (std::size_t i = 0; i < centers.size(); ++i) {
      std::vector<Quaternion> points(60);
      for (Quaternion& q : points) {
        const Vector3d x = centers[i] + within(half_side);
        q = {x.x(), x.y(), x.z(), map.dynamics.slice};
      }
      for (const double f : reference::field(map, points, 1, 1e9)) {
        const double rounding = 1e-5 * std::max(1.0, std::abs(f));
        wrong += f < static_cast<double>(bounds.low[i]) - rounding ||
                         f > static_cast<double>(bounds.high[i]) + rounding
                     ? 1
                     : 0;
      }
      useful += std::isfinite(bounds.low[i]) && std::isfinite(bounds.high[i]) ? 1 : 0;
    }
    CAPTURE(variant, kind, half_side, useful);
    CHECK(wrong == 0);
    CHECK((half_side > 0.1 || useful > centers.size() / 2));
  }
}

TEST_CASE("stop radii decide no orbit wrongly") {
  const MapKind& kind = *GENERATE(from_range(listed_kinds()));
  const StopRadii stops = find_stop_radii(test::shared_device(), kind.map);
  CAPTURE(kind, stops.inner, stops.outer);
  // A few by rounding, at the set's boundary.
  CHECK(test::wrongly_decided(kind.map, stops, points_of(kind, 1.3, 1500)) <= 6);
}

TEST_CASE("a map is the same after its file, its JSON and a picture that holds it") {
  const MapKind& kind = *GENERATE(from_range(listed_kinds()));
  INFO(kind.name);
  const test::TemporaryFolder folder;
  const nlohmann::json written = to_json(kind.map);
  CHECK(to_json(map_from_json(written, "a map")) == written);
  const auto file = folder.path() / "map.qjulia.json", picture = folder.path() / "map.png";
  write_map(kind.map, file);
  CHECK(to_json(read_map(file)) == written);
  const Image pixel{.width = 1, .height = 1, .pixels = {1, 2, 3}};
  write_png(pixel, picture, {}, packed_map(kind.map));
  CHECK(to_json(read_map(picture)) == written);
  // What reads and writes nothing of a kind would pass so far.
  const auto points = points_of(kind, 1.4, 20);
  CHECK(reference::field(read_map(picture), points, 2, 20) ==
        reference::field(kind.map, points, 2, 20));
}

TEST_CASE("versors and images are the reference's for every kind of map") {
  const test::Variant variant = GENERATE(from_range(test::variants()));
  const auto precision = GENERATE(Precision::single, Precision::dbl);
  if (!test::checks_every_kind(variant, precision)) return;
  const MapKind& kind = *GENERATE(from_range(listed_kinds()));
  if (!test::can_check(test::shared_device(), precision)) return;
  const Field field(variant.of(test::shared_device()), kind.map, precision);
  const auto points = points_of(kind, 1.4, 301);
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
  CAPTURE(variant, twice, kind);
  CHECK(most_below(turned) < (twice ? 1e-10 : 3e-5));
  CHECK(most_below(moved) < (twice ? 1e-10 : 3e-5));
  CHECK(unit < (twice ? 1e-12 : 1e-6));
  CHECK(lengths < (twice ? 1e-12 : 1e-5));
}

TEST_CASE("orbits are the reference's, and end where they escape") {
  const test::Variant variant = GENERATE(from_range(test::variants()));
  const MapKind& kind = *GENERATE(from_range(listed_kinds()));
  if (!test::can_check(test::shared_device(), Precision::dbl)) return;
  constexpr int kIterations = 5;
  const Field field(variant.of(test::shared_device()), kind.map, Precision::dbl);
  auto points = points_of(kind, 1.4, 203);
  points.push_back({0, 15, -15, 0});  // beyond the escape radius
  const auto orbits = field.orbits_at(points, kIterations);
  const auto images = field.images_at(points, kIterations);
  const auto counts = field.escape_counts_at(points, kIterations);
  const auto values = field.at(points, kIterations);
  REQUIRE(orbits.size() == points.size() * (kIterations + 1));
  CAPTURE(variant, kind);
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
  CHECK(most_below(errors) < 1e-6);
  CHECK(most_below(lengths) < 1e-9);
  CHECK(wrong_counts <= 2);
  CHECK(short_ones > 0);
  CHECK(counts.back() == 0);
  CHECK(images.back() == points.back());
}

TEST_CASE("gradients of F_n are the reference's for every kind of map") {
  const test::Variant variant = GENERATE(from_range(test::variants()));
  const auto precision = GENERATE(Precision::single, Precision::dbl);
  if (!test::checks_every_kind(variant, precision)) return;
  const MapKind& kind = *GENERATE(from_range(listed_kinds()));
  if (!test::can_check(test::shared_device(), precision)) return;
  const bool twice = precision == Precision::dbl;
  const Field field(variant.of(test::shared_device()), kind.map, precision);
  auto points = points_of(kind, 1.3, 203);
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
    const double usual = most_below(errors);
    CAPTURE(variant, twice, kind, n, usual);
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
  const MapKind& kind = *GENERATE(from_range(listed_kinds()));
  const Field field(test::shared_device(), kind.map, Precision::dbl);
  const auto points = points_of(kind, 1.3, 101);
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
