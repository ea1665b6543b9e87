// Points settled by interpolation, against their orbits in double precision.

#include <catch2/catch_all.hpp>
#include <cmath>
#include <numeric>
#include <vector>

#include "distance_map.hpp"
#include "lattice/interpolated_orbits.hpp"
#include "map/reference_iteration.hpp"
#include "random_maps.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

const StopRadii kStops{0.4, 1.9, 2.4};
constexpr double kLevel = -0.1;
/// Where sides are certain.
struct Bounds {
  double below, above;
  bool beyond(double f) const { return f < below || f > above; }
};
/// Within the stop radii on one side, beyond them on the other.
constexpr Bounds kBounds{-0.7, 1.1};

/// Three slices of a fine grid.
surface::Grid fine_grid() {
  surface::Grid grid;
  grid.origin = {-0.6, -0.5, 0.1};
  grid.step = 0.0078125;
  grid.points = {131, 117, 3};
  return grid;
}

/// Versors turn about the lines that lead from centres towards negative x. Of half the factors
/// these lines lie in the slice, and 0.3 steps off the middle one of the grid's.
Map map_with_lines(const surface::Grid& grid) {
  Map map = test::random_map(14, 0.4, 1.4, 5);
  map.dynamics.slice = 0.0625;
  map.dynamics.log_scale = 0.3;
  for (std::size_t i = 0; i < map.dynamics.factors.size(); i += 2) {
    map.dynamics.factors[i].center.w = map.dynamics.slice;
    map.dynamics.factors[i].center.z = grid.origin.z() + 1.3 * grid.step;
  }
  return map;
}

std::vector<Quaternion> points_of(const surface::Grid& grid, double slice) {
  std::vector<Quaternion> points;
  for (int k = 0; k < grid.points[2]; ++k) {
    for (int j = 0; j < grid.points[1]; ++j) {
      for (int i = 0; i < grid.points[0]; ++i) {
        const Eigen::Vector3d x = grid.at(Eigen::Vector3d(i, j, k));
        points.push_back({x.x(), x.y(), x.z(), slice});
      }
    }
  }
  return points;
}

/// Points of the grid by what settled them.
struct Settled {
  std::size_t by_point = 0, by_image = 0, nodes = 0;
  std::size_t close = 0;  ///< little was taken off for what it may be off
};

/// Settles a grid's points, and checks that they are where their orbits have them.
Settled check_settled(const Device& device, Precision precision, const surface::Grid& grid,
                      const Map& map, const Bounds& bounds) {
  const surface::GridBlock block = surface::slices(grid, 0, grid.points[2]);
  const auto points = points_of(grid, map.dynamics.slice);
  const auto first = reference::field(map, points, 1, kStops.escape);
  const auto second = reference::field(map, points, 2, kStops.escape);

  const map::DeviceMap on_device(device, map, kStops, precision);
  std::vector<std::int32_t> numbers(points.size());
  std::iota(numbers.begin(), numbers.end(), 0);
  std::vector<float> values(points.size(), NAN);
  const auto [others, nodes] = surface::settle_by_interpolation(
      on_device, grid, block, bounds.below, kLevel, bounds.above, numbers, values);

  Settled settled;
  settled.nodes = nodes;
  std::size_t missed = 0, wrong = 0, too_far = 0;
  for (const std::int32_t other : others) {
    if (!std::isnan(values[static_cast<std::size_t>(other)])) ++missed;
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto value = static_cast<double>(values[i]);
    if (std::isnan(value)) continue;
    const bool at_point = bounds.beyond(first[i]);
    const bool goes_on = first[i] > std::log(kStops.inner) && first[i] < std::log(kStops.outer);
    (at_point ? settled.by_point : settled.by_image) += 1;
    const double exact = at_point ? first[i] : second[i];
    // On its side of the level, and no farther from it than the true one.
    if ((!at_point && !goes_on) || !bounds.beyond(value) || (value < kLevel) != (exact < kLevel))
      ++wrong;
    if (std::abs(value - kLevel) > std::abs(exact - kLevel) + 1e-4) ++too_far;
    if (std::abs(value - exact) < 0.5) ++settled.close;
  }
  const std::size_t all_settled = settled.by_point + settled.by_image;
  CAPTURE(settled.nodes, settled.by_point, settled.by_image, wrong, too_far, settled.close);
  CHECK(missed == 0);
  CHECK(others.size() + all_settled == points.size());
  CHECK(wrong == 0);
  CHECK(too_far == 0);
  return settled;
}

/// In both precisions, as far as the device has them.
Settled check_settled(const Device& device, const surface::Grid& grid, const Map& map,
                      const Bounds& bounds) {
  if (test::can_check(device, Precision::dbl)) {
    check_settled(device, Precision::dbl, grid, map, bounds);
  }
  return check_settled(device, Precision::single, grid, map, bounds);
}

}  // namespace

TEST_CASE("settled points are on their side, by no more than their orbits have it") {
  const auto device =
      test::shared_device().with_lane_width(GENERATE(from_range(test::lane_widths())));
  const surface::Grid grid = fine_grid();
  const Settled settled = check_settled(device, grid, map_with_lines(grid), kBounds);
  // Worth having.
  const std::size_t all = points_of(grid, 0).size();
  CHECK(settled.by_point > all / 20);
  CHECK(settled.by_image > all / 10);
  CHECK(settled.close > (settled.by_point + settled.by_image) / 2);
  CHECK(settled.nodes > 0);
  CHECK(settled.nodes < all / 4);
}

TEST_CASE("points are settled on their side where the field is steeper outside") {
  const auto device =
      test::shared_device().with_lane_width(GENERATE(from_range(test::lane_widths())));
  const surface::Grid grid = fine_grid();
  Map map = map_with_lines(grid);
  map.dynamics.surface_level = kLevel;
  map.layers.steepness = 2.5;
  const Settled settled = check_settled(device, grid, map, kBounds);
  const std::size_t all = points_of(grid, 0).size();
  CHECK(settled.by_point > all / 20);
  CHECK(settled.by_image > all / 20);
}

TEST_CASE("with a distance for a modulus they are too, across its creases") {
  const auto device =
      test::shared_device().with_lane_width(GENERATE(from_range(test::lane_widths())));
  surface::Grid grid = fine_grid();
  grid.origin = {-0.9, -0.6, 0.3};  // across the crease between the balls
  Map map = test::distance_map(0.15, 4);
  map.dynamics.surface_level = kLevel;
  map.layers.steepness = GENERATE(1.0, 2.5);
  const Settled settled = check_settled(device, grid, map, kBounds);
  const std::size_t all = points_of(grid, 0).size();
  CHECK(settled.by_point > all / 20);
  CHECK(settled.by_image > all / 20);
  CHECK(settled.close > settled.by_point);
}

TEST_CASE("points of a tiny grid are settled too") {
  surface::Grid grid = fine_grid();
  grid.origin = {-0.6, 0.1, 0.15};
  grid.points = {37, 31, 1};
  Map map = map_with_lines(fine_grid());
  map.dynamics.factors.resize(8);
  const Settled settled =
      check_settled(test::shared_device(), Precision::single, grid, map, kBounds);
  CHECK(settled.by_image > 0);
}

TEST_CASE("a versor that jumps half way between nodes is not taken for a smooth one") {
  const Device device = test::shared_device();
  const surface::Grid grid = fine_grid();
  // Wherever nodes are, for some of these rows one factor's line is half way between two.
  std::size_t by_image = 0;
  for (int row = 50; row < 60; ++row) {
    Map map = map_with_lines(grid);
    for (std::size_t i = 0; i < map.dynamics.factors.size(); i += 2)
      map.dynamics.factors[i].center.z += 0.4;
    const Eigen::Vector3d end = grid.at(Eigen::Vector3d(125, row, 1.3));
    map.dynamics.factors[0] = {{end.x(), end.y(), end.z(), map.dynamics.slice}, -0.5};
    by_image += check_settled(device, Precision::single, grid, map, kBounds).by_image;
  }
  CHECK(by_image > 10 * points_of(grid, 0).size() / 25);
}

TEST_CASE("points beyond the escape radius, few points and steep maps are left alone") {
  const Device device = test::shared_device();
  const surface::Grid grid = fine_grid();
  Map map = map_with_lines(grid);
  const auto settled = [&](const StopRadii& stops, std::size_t count) {
    const map::DeviceMap on_device(device, map, stops, Precision::single);
    std::vector<std::int32_t> numbers(count);
    std::iota(numbers.begin(), numbers.end(), 0);
    std::vector<float> values(surface::GridBlock{{0, 0, 0}, grid.points}.size());
    const auto others =
        surface::settle_by_interpolation(on_device, grid, surface::slices(grid, 0, grid.points[2]),
                                         kBounds.below, kLevel, kBounds.above, numbers, values);
    return count - others.numbers.size();
  };
  const std::size_t all = surface::GridBlock{{0, 0, 0}, grid.points}.size();
  CHECK(settled(kStops, all) > 0);
  CHECK(settled(kStops, 100) == 0);
  // All points are farther out than this.
  CHECK(settled({0.04, 0.06, 0.05}, all) == 0);
  for (Factor& factor : map.dynamics.factors) factor.exponent *= 60;
  CHECK(settled(kStops, all) == 0);
}
