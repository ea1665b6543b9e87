// Maps with portals, through everything that iterates maps.

#include <Eigen/Geometry>
#include <catch2/catch_all.hpp>
#include <cmath>

#include "armed_ball.hpp"
#include "base/larger_error.hpp"
#include "distance_map.hpp"
#include "lattice/level_set.hpp"
#include "map/portals.hpp"
#include "map/reference_iteration.hpp"
#include "map_checks.hpp"
#include "picture/band_grid.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/edit/portal_choice.hpp"
#include "qjulia/map/detail.hpp"
#include "qjulia/map/knobs.hpp"
#include "qjulia/surface/surface.hpp"
#include "test_device.hpp"

using namespace qjulia;
using Eigen::Vector3d;

namespace {

/// Two balls with a copy on either side, turned and led elsewhere than to the origin, and a third
/// of which only the part inside the shape is left.
Map map_with_portals(PortalMask mask = PortalMask::none) {
  Map map = test::distance_map(0.12);
  map.dynamics.phase = {0.8, 0, 0.6, 0};
  map.layers.portals = {
      {{1.05, 0.1, 0}, 0.4, 4.5, {{0.2, 1, -0.4}, 70}, {-0.3, 0.1, 0}, mask},
      {{-1.5, 0.5, 0.1}, 0.35, 3.5, {{1, 0, 0}, 0}, {-0.3, 0.1, 0}, mask},
      {{-0.2, -0.75, 0}, 0.15, 6, {{0, 0, 1}, -40}, {-0.2, 0.1, 0}, PortalMask::inside}};
  return map;
}

Map factors_with_portals(PortalMask mask) {
  Map map = test::random_map(9, 0.2, 0.9, 3);
  map.dynamics.surface_level = -0.2;
  map.layers.portals = {{{0.9, 0.2, 0.1}, 0.5, 2.5, {{0, 1, 1}, 50}, {0.1, 0, 0}, mask},
                        {{-0.8, -0.1, 0.4}, 0.45, 3, {}, {0, 0, 0}, mask}};
  return map;
}

/// The armed ball's distance, with a thin shell: points beyond the grid's domain are many shells
/// away.
Map armed_distance_map() {
  const auto distances = [](std::span<const Vector3d> points) {
    std::vector<double> found(points.size());
    std::ranges::transform(points, found.begin(), test::armed_ball_distance);
    return found;
  };
  Map map = test::distance_map();
  map.frame.box = Box{{-1.2, -1.4, -0.9}, {1.5, 1.1, 0.75}};
  DistanceModulus modulus = exact::sampled_distance(distances, *map.frame.box, 64, {});
  modulus.shell = 0.03;
  modulus.inradius = 0.75;
  map.dynamics.modulus = modulus;
  map.frame.detail = modulus.shell / map.frame.box->diagonal();
  map.frame.inradius = modulus.inradius;
  return map;
}

std::vector<Quaternion> points_about(const Vector3d& middle, double reach, std::size_t count) {
  return test::random_points(8, count, reach, 0.3 * reach, middle);
}

/// How near q is to a portal's rim.
double to_rim(const Map& map, const Quaternion& q) {
  double nearest = 1e9;
  for (const Portal& portal : map.layers.portals) {
    const Vector3d x = Vector3d(q.x, q.y, q.z) - portal.center;
    nearest = std::min(nearest, std::abs(std::hypot(x.norm(), q.w) - portal.radius));
  }
  return nearest;
}

/// Where the portal leads a point, by Rodrigues' formula in Eigen's terms.
Quaternion led_by(const Portal& portal, const Quaternion& q) {
  const Vector3d x =
      portal.destination +
      portal.scale * (portal.rotation.matrix() * (Vector3d(q.x, q.y, q.z) - portal.center));
  return {x.x(), x.y(), x.z(), portal.scale * q.w};
}

/// The point it leads to q.
Quaternion led_to(const Portal& portal, const Quaternion& q) {
  const Vector3d x = portal.center + portal.rotation.matrix().transpose() *
                                         (Vector3d(q.x, q.y, q.z) - portal.destination) /
                                         portal.scale;
  return {x.x(), x.y(), x.z(), q.w / portal.scale};
}

}  // namespace

TEST_CASE("in a portal the gradient is that of the image's radius") {
  const auto variant = GENERATE(from_range(test::variants()));
  const Map map = map_with_portals();
  std::vector<Quaternion> points;
  for (const Portal& portal : map.layers.portals) {
    for (const Quaternion& q : points_about(portal.center, 0.7 * portal.radius, 60)) {
      if (to_rim(map, q) > 0.01) points.push_back(q);
    }
  }
  const auto gradients =
      Field(variant.of(test::shared_device()), map, Precision::single).gradient_at(points);
  double worst = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Quaternion expected = test::reference_gradient(map, points[i]);
    // The third portal's mask jumps at the set's boundary.
    if (norm(expected) > 1e3) continue;
    worst =
        base::larger_error(worst, norm(gradients[i] - expected) / std::max(1.0, norm(expected)));
  }
  CHECK(worst < 2e-3);
}

TEST_CASE("bounds over cubes tell sides that orbits have") {
  const auto variant = GENERATE(from_range(test::variants()));
  const auto mask = GENERATE(PortalMask::none, PortalMask::outside);
  const int iterations = GENERATE(1, 5);
  Map map = map_with_portals(mask);
  map.dynamics.slice = 0.05;
  const StopRadii stops = find_stop_radii(test::shared_device(), map);
  const surface::LevelSet set(variant.of(test::shared_device()), map, stops, iterations);
  const double level = map.dynamics.surface_level;
  const double half_side = GENERATE(0.004, 0.02, 0.1);
  std::mt19937_64 bits(9);
  std::vector<Eigen::Vector3d> centers;
  for (std::size_t i = 0; i < 151; ++i) {
    const double x = test::uniform(bits, -2, 1.6);
    const double y = test::uniform(bits, -1.2, 1.2);
    const double z = test::uniform(bits, -0.6, 0.6);
    if (i % 3 == 0) {
      centers.emplace_back(x, y, z);
      continue;
    }
    const Portal& portal = map.layers.portals[i % 3 - 1];
    const Vector3d in_ball = portal.center + 0.5 * portal.radius * Vector3d(x, y, z);
    centers.push_back(in_ball);
  }
  const auto bounds = set.bounds(centers, half_side);
  std::size_t wrong = 0, decided_in_portals = 0;
  for (std::size_t i = 0; i < centers.size(); ++i) {
    const auto low = static_cast<double>(bounds.low[i]), high = static_cast<double>(bounds.high[i]);
    const bool inside = high < set.certainly_inside_below(level);
    const bool outside = low > set.certainly_outside_above(level);
    CHECK(low <= high);
    if (!inside && !outside) continue;
    const Vector3d& center = centers[i];
    for (const Portal& portal : map.layers.portals) {
      if ((center - portal.center).norm() + 0.05 < portal.radius) ++decided_in_portals;
    }
    std::vector<Quaternion> points;
    for (int k = 0; k < 30; ++k) {
      const auto offset = [&] { return half_side * test::uniform(bits, -1, 1); };
      const double x = center.x() + offset();
      const double y = center.y() + offset();
      points.push_back({x, y, center.z() + offset(), map.dynamics.slice});
    }
    for (const double f : reference::field(map, points, iterations, stops.escape)) {
      if ((f < level) != inside) ++wrong;
    }
  }
  CAPTURE(half_side, decided_in_portals);
  CHECK(wrong == 0);
  // Images that go on are bounded too.
  if (half_side < 0.01 && iterations > 1) CHECK(decided_in_portals > 10);
}

TEST_CASE("no portal reaches the ball that orbits stay in, or beyond which none returns") {
  Map map = map_with_portals();
  const StopRadii plain = find_stop_radii(test::shared_device(), without_portals(map));
  const StopRadii stops = find_stop_radii(test::shared_device(), map);
  const auto [nearest, farthest] = map::portal_reach(map.layers.portals);
  CHECK(stops.inner > 0);
  CHECK(stops.inner <= nearest);
  CHECK(stops.outer == std::max(plain.outer, farthest));
  CHECK(stops.escape == Catch::Approx(1.25 * stops.outer));
  const auto points = points_about({-0.2, 0, 0}, 1.4, 2000);
  CHECK(test::wrongly_decided(map, stops, points) <= 6);  // by rounding, at the set's boundary
}

TEST_CASE("a portal of scale 1 to its own centre changes no orbit that does not enter it") {
  const auto variant = GENERATE(from_range(test::variants()));
  Map map = test::distance_map(0.12);
  const Portal still{{1.0, 0.2, 0}, 0.3, 1, {}, {1.0, 0.2, 0}, PortalMask::none};
  map.layers.portals = {still};
  const auto points = points_about({0, 0, 0}, 1.6, 1201);
  const Device device = variant.of(test::shared_device());
  for (const int n : {1, 3}) {
    const auto found = Field(device, map).at(points, n);
    const auto plain = Field(device, without_portals(map)).at(points, n);
    std::size_t outside = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      Quaternion q = points[i];
      bool enters = false;
      for (int k = 0; k < n && norm(q) < 20; ++k) {
        const double rim = std::hypot(q.x - 1.0, q.y - 0.2, std::hypot(q.z, q.w)) - 0.3;
        enters = enters || rim < 1e-3;
        const auto [f, u] = reference::step(without_portals(map), q);
        q = std::exp(std::min(f, 40.0)) * u;
      }
      // Within it a point stays where it is.
      const bool starts_within =
          (Vector3d(points[i].x, points[i].y, points[i].z) - still.center).norm() < 0.25 &&
          std::abs(points[i].w) < 0.1;
      if (starts_within) CHECK(found[i] == Catch::Approx(std::log(norm(points[i]))).margin(1e-5));
      if (enters) continue;
      ++outside;
      CHECK(found[i] == plain[i]);
    }
    CHECK(outside > points.size() / 2);
  }
}

TEST_CASE("copies on copies are the set, three deep") {
  const auto variant = GENERATE(from_range(test::variants()));
  const Map map = map_with_portals();
  const Portal& portal = map.layers.portals[0];
  const Field field(variant.of(test::shared_device()), map, Precision::single);
  // About the tip that the portal itself stands on: the chain goes on into it.
  const auto points = points_about({0.75, 0.1, 0}, 0.35, 600);
  const auto whole = field.at(points, 3);
  std::vector<Quaternion> copies = points;
  for (int depth = 1; depth <= 3; ++depth) {
    for (Quaternion& q : copies) q = led_to(portal, q);
    const auto found = field.at(copies, 3 + depth);
    std::size_t compared = 0, different = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      // Only what lies in the ball at each depth.
      Quaternion q = copies[i];
      bool stays = true;
      for (int k = 0; k < depth; ++k, q = led_by(portal, q)) {
        const Vector3d x = Vector3d(q.x, q.y, q.z) - portal.center;
        stays = stays && std::hypot(x.norm(), q.w) < portal.radius - 1e-3;
      }
      if (!stays) continue;
      ++compared;
      if ((found[i] < map.dynamics.surface_level) != (whole[i] < map.dynamics.surface_level))
        ++different;
    }
    CAPTURE(depth, compared);
    CHECK(compared > 200);
    CHECK(different <= compared / 50);  // rounding, at the set's boundary
  }
}

TEST_CASE("the sparse surface of a map with portals is the dense one, with its copies") {
  const auto variant = GENERATE(from_range(test::variants()));
  const auto mask = GENERATE(PortalMask::none, PortalMask::outside);
  const Device device = variant.of(test::shared_device());
  const Map map = map_with_portals(mask);
  SurfaceOptions options;
  options.resolution = 96;
  options.iterations = GENERATE(1, 6);
  const auto [mesh, report] = test::checked_surface(device, map, options);
  CHECK(report.potentials < report.grid_points * 3 / 5);
  // Copies stand where the shape does not reach.
  CHECK(mesh.box().high.x() > map.frame.box->high.x() + 0.1);
}

TEST_CASE("rays find the set that orbits have") {
  const auto variant = GENERATE(from_range(test::variants()));
  const auto mask = GENERATE(PortalMask::none, PortalMask::outside);
  const Map map = map_with_portals(mask);
  test::check_rays(variant.of(test::shared_device()), map, *map::box_with_copies(map),
                   GENERATE(1, 5));
}

TEST_CASE("rays that begin far from the shape, beside its portals, find all of its limbs") {
  const auto variant = GENERATE(from_range(test::variants()));
  const Device device = variant.of(test::shared_device());
  const bool exact = GENERATE(true, false);
  Map map = exact ? armed_distance_map()
                  : calibrated(test::shared_device(), steepened(test::armed_ball_map(60), 12));
  map.layers.steepness = GENERATE(1.0, 2.0);
  if (!exact && map.layers.steepness > 1) return;
  // Copies on copies widen the space that rays go through, so that many begin far from the shape.
  map.layers.portals = {
      {{-1.9, 1.9, 1.3}, 1.4, 2, {}, {0, -1.3, -0.7}, PortalMask::outside},
      {{2.3, 0.6, -0.6}, 1.1, 2.5, {{0, 0, 1}, 90}, {0, -1.2, -0.6}, PortalMask::outside}};
  for (const double azimuth : {35.0, 150.0, 290.0}) {
    CAPTURE(variant, exact, map.layers.steepness, azimuth);
    Camera camera;
    camera.azimuth = azimuth;
    camera.zoom = 2.5;
    test::check_rays(device, map, *map::box_with_copies(map), 5, camera);
  }
}

TEST_CASE("a portal with a tiny copy changes no ray's steps but those about the copy") {
  const auto variant = GENERATE(from_range(test::variants()));
  const auto mask = GENERATE(PortalMask::none, PortalMask::outside);
  const Device device = variant.of(test::shared_device());
  Map map = test::distance_map(0.12);
  // A part of space that holds only the copy.
  map.layers.portals = {{{0.5, 1.0, 0.3}, 0.3, Portal::kMostScale, {}, {0, 0, 0}, mask}};
  const picture::MarchedSet with{map, 5, {}, {}, Precision::single};
  const picture::MarchedSet without{without_portals(map), 5, {}, {}, Precision::single};
  const picture::Band band = picture::find_band(device, with, *map.frame.box);
  const picture::Band plain = picture::find_band(device, without, *map.frame.box);
  REQUIRE(band.level == plain.level);
  CHECK(band.steepest == plain.steepest);
  const picture::View view = picture::camera_view({}, *map.frame.box, 96, 72, 1);
  const auto found = picture::march_source(device, with)->depths(view, 0, view.rows);
  const auto expected = picture::march_source(device, without)->depths(view, 0, view.rows);
  std::size_t different = 0, hits = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (expected[i] >= 0) ++hits;
    if (std::abs(found[i] - expected[i]) > 2 * view.footprint) ++different;
  }
  CHECK(hits > 500);
  CHECK(different <= hits / 50);  // rays that graze it
}

TEST_CASE("knobs move portals with the shape") {
  Map map = map_with_portals();
  MapKnobs knobs;
  knobs.translate = Vector3d(0.05, -0.1, 0.02);
  const Map moved = with_knobs(test::shared_device(), map, knobs);
  const double shift = moved.dynamics.surface_level - map.dynamics.surface_level;  // calibration
  std::size_t different = 0;
  for (const Quaternion& q : points_about(map.layers.portals[0].center, 0.3, 200)) {
    const Quaternion there = q + Quaternion{0.05, -0.1, 0.02, 0};
    const auto [f, u] = reference::step(map, q);
    const auto [g, v] = reference::step(moved, there);
    // Images in portals move along; others turn about the origin.
    const Quaternion a = std::exp(f) * u + Quaternion{0.05, -0.1, 0.02, 0}, b = std::exp(g) * v;
    const bool in_portal = to_rim(map, q) > 1e-6 &&
                           (Vector3d(q.x, q.y, q.z) - map.layers.portals[0].center).norm() < 0.28 &&
                           std::abs(q.w) < 0.1;
    if (in_portal && norm(a - b) > 1e-9) ++different;
    if (!in_portal && to_rim(map, q) > 0.3 && std::abs(g - f - shift) > 1e-9) ++different;
  }
  CHECK(different == 0);
  CHECK(moved.layers.portals[1].radius == map.layers.portals[1].radius);
  // The origin must not get into one.
  knobs.translate = Vector3d(-0.9, 0, 0);
  CHECK_THROWS_WITH(with_knobs(test::shared_device(), map, knobs),
                    Catch::Matchers::ContainsSubstring("portal"));

  Map factors = factors_with_portals(PortalMask::none);
  knobs = {};
  knobs.rotate = Rotation{{1, 0, 0}, 35};  // about the real axis: the map itself turns
  const Map turned = with_knobs(test::shared_device(), factors, knobs);
  const Eigen::Matrix3d turn = knobs.rotate->matrix();
  double worst = 0;
  for (const Quaternion& q : points_about({0, 0, 0}, 1.4, 300)) {
    const auto turned_about = [&](const Quaternion& p) {
      const Vector3d x = turn * Vector3d(p.x, p.y, p.z);
      return Quaternion{x.x(), x.y(), x.z(), p.w};
    };
    if (to_rim(factors, q) < 1e-6) continue;
    const bool within = std::ranges::any_of(factors.layers.portals, [&](const Portal& p) {
      return std::hypot((Vector3d(q.x, q.y, q.z) - p.center).norm(), q.w) < p.radius;
    });
    if (!within) continue;
    const auto [f, u] = reference::step(factors, q);
    const auto [g, v] = reference::step(turned, turned_about(q));
    worst = base::larger_error(worst, norm(turned_about(std::exp(f) * u) - std::exp(g) * v));
  }
  CHECK(worst < 1e-9);
}

TEST_CASE("portals are proposed on tips, apart from each other and clear of the origin") {
  const Map map = test::distance_map(0.05);
  PortalOptions options;
  options.count = 4;
  options.size = 0.25;
  const auto portals = proposed_portals(test::shared_device(), map, options);
  REQUIRE(portals.size() >= 2);
  Map with = map;
  with.layers.portals = portals;
  CHECK_NOTHROW(with.validate());
  // The farthest tip along the surface is the small ball's far side.
  CHECK(portals[0].center.x() < -1.2);
  CHECK(proposed_portals(test::shared_device(), with, options) == portals);
  CHECK(visible_depth(portals) == 3);
  // What was inside is inside, and the copies are there besides.
  SurfaceOptions surface;
  surface.resolution = 64;
  const auto volume = [&](const Map& m) {
    const TriangleMesh mesh = extract_surface(test::shared_device(), m, surface);
    double sum = 0;
    for (const auto& [a, b, c] : mesh.triangles) {
      sum += mesh.vertices[a].dot(mesh.vertices[b].cross(mesh.vertices[c])) / 6;
    }
    return sum;
  };
  const double plain = volume(map), stacked = volume(with);
  CHECK(stacked > plain * (1 + 0.5 * static_cast<double>(portals.size()) * std::pow(0.25, 3)));
  CHECK(stacked < plain * 1.2);
  options.size = 0.7;
  CHECK_THROWS_WITH(proposed_portals(test::shared_device(), map, options),
                    Catch::Matchers::ContainsSubstring("size"));
  options = {};
  options.count = 0;
  CHECK_THROWS_WITH(options.validate(), Catch::Matchers::ContainsSubstring("count"));
}

TEST_CASE("a copy is planted on the nearest point, clear of others and of the origin") {
  const Map map = test::distance_map(0.05);
  const auto plant = [](const Map& on, const Vector3d& place, double size) {
    const auto portals = planted_portals(test::shared_device(), on, place, size);
    REQUIRE(portals.size() == on.layers.portals.size() + 1);
    return portals.back();
  };
  // Across the surface on the small ball's far side, as a proposal stands on the tip there.
  const auto proposed = proposed_portals(test::shared_device(), map, {.count = 1, .size = 0.25});
  const Vector3d tip = map.frame.shape_to_map.to_shape(proposed.at(0).center);
  const Portal copy = plant(map, tip, 0.25);
  CHECK(copy.scale == Catch::Approx(4));
  CHECK(copy.destination == proposed[0].destination);
  CHECK((copy.center - proposed[0].center).norm() < 0.2);
  // From far above the large ball it stands on its top, and its middle above it.
  const Box box = map.frame.shape_to_map.to_map(*map.frame.box);
  const Vector3d above(0, box.high.y() + 3, 0);
  const Portal top = plant(map, map.frame.shape_to_map.to_shape(above), 0.2);
  CHECK(top.center.y() > box.high.y());
  CHECK(std::hypot(top.center.x(), top.center.z()) < 0.3);
  Map with = map;
  with.layers.portals = {copy};
  with.layers.portals =
      planted_portals(test::shared_device(), with, map.frame.shape_to_map.to_shape(above), 0.2);
  REQUIRE(with.layers.portals.size() == 2);
  CHECK_NOTHROW(with.validate());
  CHECK(with.layers.portals[0].center == copy.center);
  CHECK(with.layers.portals[1].center == top.center);
  for (const Portal& portal : with.layers.portals) {
    for (const Portal& other : with.layers.portals) {  // the ball holds the other's copy on its own
      CHECK((other.center - portal.destination).norm() + portal.radius <=
            portal.radius * portal.scale);
    }
  }
  using Catch::Matchers::ContainsSubstring;
  CHECK_THROWS_WITH(plant(with, tip, 0.25), ContainsSubstring("another copy's ball"));
  CHECK_THROWS_WITH(plant(map, tip, 0.7), ContainsSubstring("size"));
  with.layers.portals.assign(kMostPortals, copy);
  CHECK_THROWS_AS(plant(with, tip, 0.2), InputError);
  Map slice = map;
  slice.dynamics.slice = 0.1;
  CHECK_THROWS_WITH(plant(slice, tip, 0.2), ContainsSubstring("slice"));
}
