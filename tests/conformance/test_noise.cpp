// Maps whose versor is noise, through everything that iterates maps.

#include <catch2/catch_all.hpp>
#include <cmath>

#include "base/larger_error.hpp"
#include "distance_map.hpp"
#include "map/reference_iteration.hpp"
#include "map_checks.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/exact/exact_map.hpp"
#include "qjulia/map/knobs.hpp"
#include "qjulia/surface/surface.hpp"
#include "shapes.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

Map noise_map(NoiseValues values, int octaves = 3) {
  Map map = test::distance_map(0.1);
  map.dynamics.factors.clear();
  map.dynamics.versor = NoiseVersor{octaves, 4.3, 3000000019U, values, {0.1, -0.2, 0.05}};
  return map;
}

std::vector<Quaternion> points_within(double reach, std::size_t count) {
  return test::random_points(14, count, reach, 0.3);
}

Quaternion versor_at(const Map& map, const Quaternion& q) { return reference::step(map, q).versor; }

}  // namespace

TEST_CASE(
    "a noise's versors are smooth unit quaternions of every direction, other with each seed") {
  Map map = noise_map(NoiseValues::vectors, 1);
  const auto points = points_within(1.2, 4000);
  Quaternion mean;
  double out_of_slice = 0, worst = 0, turn = 0;
  for (const Quaternion& q : points) {
    const Quaternion u = versor_at(map, q);
    worst = base::larger_error(worst, std::abs(norm(u) - 1));
    out_of_slice = base::larger_error(out_of_slice, std::abs(u.w));
    mean = mean + (1.0 / 4000) * u;
    turn += norm(versor_at(map, q + Quaternion{1e-4, 0, 0, 0}) - u) / 4000;
  }
  CHECK(worst < 1e-12);
  CHECK(out_of_slice == 0);
  CHECK(norm(mean) < 0.25);
  CHECK(turn < 1e-4 * 60);
  auto& noise = std::get<NoiseVersor>(map.dynamics.versor);
  const Quaternion before = versor_at(map, points[0]);
  noise.seed += 1;
  CHECK(norm(versor_at(map, points[0]) - before) > 1e-3);
  // Octaves add finer turns.
  noise.octaves = 5;
  double rough = 0;
  for (const Quaternion& q : points) {
    rough += norm(versor_at(map, q + Quaternion{1e-4, 0, 0, 0}) - versor_at(map, q)) / 4000;
  }
  CHECK(rough > 1.5 * turn);
  noise.values = NoiseValues::quaternions;
  double w = 0;
  for (const Quaternion& q : points) w = std::max(w, std::abs(versor_at(map, q).w));
  CHECK(w > 0.9);
}

TEST_CASE(
    "with vectors, orbits that start in the slice W = 0 stay in it, and r_out and r_in hold") {
  const Map map = noise_map(NoiseValues::vectors);
  const StopRadii stops = find_stop_radii(test::shared_device(), map);
  CHECK(stops.inner > 0.3);
  auto points = points_within(1.3, 1500);
  for (Quaternion& q : points) {
    q.w = 0;
    const auto [f, u] = reference::step(map, q);
    CHECK(u.w == 0);
  }
  CHECK(test::wrongly_decided(map, stops, points) <= 6);  // by rounding, at the set's boundary
}

TEST_CASE("the sparse surface of a noise is the dense one") {
  const auto variant = GENERATE(from_range(test::variants()));
  const Device device = variant.of(test::shared_device());
  const Map map = noise_map(GENERATE(NoiseValues::vectors, NoiseValues::quaternions));
  SurfaceOptions options;
  options.resolution = 80;
  const SurfaceReport report = test::checked_surface(device, map, options).report;
  CHECK(report.settled == 0);
  CHECK(report.potentials < report.grid_points * 3 / 4);
}

TEST_CASE("an exact map takes a noise, which moves with the shape") {
  ExactMapOptions options;
  options.resolution = 48;
  options.versor = NoiseVersor{};
  const Map map = exact_map(test::shared_device(), shapes::torus(), options);
  CHECK(map.dynamics.kind() == "distance/noise");
  CHECK(map.dynamics.factors.empty());
  MapKnobs knobs;
  knobs.translate = Eigen::Vector3d(0.02, 0.01, 0);
  const Map moved = with_knobs(test::shared_device(), map, knobs);
  const double scale = map.frame.shape_to_map.scale;
  const Quaternion q{0.3, -0.2, 0.1, 0.05};
  const Quaternion there = q + Quaternion{0.02 * scale, 0.01 * scale, 0, 0};
  CHECK(norm(versor_at(moved, there) - versor_at(map, q)) < 1e-9);
  knobs = {};
  knobs.order_seed = 1;
  CHECK_THROWS_WITH(with_knobs(test::shared_device(), map, knobs),
                    Catch::Matchers::ContainsSubstring("order_seed"));
  knobs = {};
  knobs.detail = 0.01;
  Map factors = test::random_map(7, 0.4, 0.9, 5);
  for (Factor& factor : factors.dynamics.factors) factor.exponent = std::abs(factor.exponent);
  factors.dynamics.versor = NoiseVersor{};
  factors.frame.detail = 0.02;
  const Map thin = with_knobs(test::shared_device(), factors, knobs);
  CHECK(thin.dynamics.factors[2].exponent ==
        Catch::Approx(2 * factors.dynamics.factors[2].exponent));
  options.versor = NoiseVersor{.octaves = 0};
  CHECK_THROWS_WITH(options.validate(), Catch::Matchers::ContainsSubstring("octaves"));
}
