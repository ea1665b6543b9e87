#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "base/larger_error.hpp"
#include "lattice/level_set.hpp"
#include "random_maps.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

/// Origin and step of few bits: coordinates are exact wherever they are computed.
surface::Grid exact_grid() {
  surface::Grid grid;
  grid.origin = {-1.5, -1.25, -1.75};
  grid.step = 0.0625;
  grid.points = {47, 41, 53};
  return grid;
}

std::vector<Quaternion> points_of(const surface::Grid& grid, const surface::GridBlock& block,
                                  double slice) {
  std::vector<Eigen::Vector3d> points;
  for (int k = 0; k < block.count[2]; ++k) {
    for (int j = 0; j < block.count[1]; ++j) {
      for (int i = 0; i < block.count[0]; ++i) {
        points.push_back(
            grid.at(Eigen::Vector3d(block.first[0] + i, block.first[1] + j, block.first[2] + k)));
      }
    }
  }
  return on_slice(points, slice);
}

/// F_1 in double, by its definition.
double potential(const Map& map, const Quaternion& q) {
  double sum = map.dynamics.log_scale;
  for (const Factor& factor : map.dynamics.factors) {
    sum += factor.exponent * std::log(norm(q - factor.center));
  }
  return sum;
}

const StopRadii kLevelStops{0.4, 1.9, 2.4};

Map sliced_map() {
  Map map = test::random_map(9, 0.2, 0.6, 5);
  map.dynamics.slice = 0.0625;
  map.dynamics.log_scale = -0.4;
  return map;
}

}  // namespace

TEST_CASE("one iterate on a grid is the potential, and ln |q| beyond the escape radius") {
  const auto device =
      test::shared_device().with_lane_width(GENERATE(from_range(test::lane_widths())));
  const Map map = sliced_map();
  const surface::Grid grid = exact_grid();
  const surface::GridBlock block = surface::slices(grid, 0, 5);
  const auto values = surface::LevelSet(device, map, kLevelStops, 1).over(grid, block);
  const auto points = points_of(grid, block, map.dynamics.slice);
  REQUIRE(values.size() == points.size());
  double worst = 0;
  std::size_t escaped = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double radius = norm(points[i]);
    if (std::abs(radius - kLevelStops.escape) < 1e-5) continue;
    if (radius > kLevelStops.escape) ++escaped;
    const double expected =
        radius < kLevelStops.escape ? potential(map, points[i]) : std::log(radius);
    worst = base::larger_error(worst, std::abs(values[i] - expected));
  }
  CHECK(escaped > 0);
  CHECK(worst < 5e-6);
}

TEST_CASE("iterating only what is undecided gives the values of iterating everything") {
  const auto device =
      test::shared_device().with_lane_width(GENERATE(from_range(test::lane_widths())));
  const int iterations = GENERATE(2, 6);
  const Map map = sliced_map();
  const surface::Grid grid = exact_grid();
  // Neither the block's size nor the number of undecided points is a multiple of the lanes.
  const surface::GridBlock block{{3, 2, 1}, {41, 37, 45}};
  const auto values = surface::LevelSet(device, map, kLevelStops, iterations).over(grid, block);
  const Field field(device, map, Precision::single, kLevelStops);
  const auto points = points_of(grid, block, map.dynamics.slice);
  const auto dense = field.decided_at(points, iterations);
  const auto first = field.decided_at(points, 1);
  REQUIRE(values.size() == dense.size());
  std::size_t iterated = 0;
  std::size_t different = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (static_cast<double>(values[i]) != dense[i]) ++different;
    if (dense[i] != first[i]) ++iterated;
  }
  CHECK(different == 0);
  CHECK(iterated > values.size() / 100);
  CHECK(iterated < values.size());
}

TEST_CASE(
    "a dense evaluation runs orbits to their end, and keeps what stopping told if it was so") {
  const auto device =
      test::shared_device().with_lane_width(GENERATE(from_range(test::lane_widths())));
  const auto precision = GENERATE(Precision::single, Precision::dbl);
  if (!test::can_check(device, precision)) return;
  const Map map = sliced_map();
  const surface::Grid grid = exact_grid();
  const surface::GridBlock block{{3, 2, 1}, {41, 37, 45}};
  const auto points = points_of(grid, block, map.dynamics.slice);
  const int iterations = 6;
  const auto ends =
      Field(device, map, precision, {0, 0, kLevelStops.escape}).at(points, iterations);
  // Radii that stop some orbits for the wrong side.
  const StopRadii stops{1.4, 1.5, kLevelStops.escape};
  const auto stopped = Field(device, map, precision, stops).decided_at(points, iterations);
  const double level = 0.125;
  const surface::LevelSet set(device, map, stops, iterations, precision);
  const auto values = set.densely_over(grid, block, level);
  REQUIRE(values.size() == ends.size());
  std::size_t wrong = 0, kept = 0, mended = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const bool agree = (ends[i] < level) == (stopped[i] < level);
    if (values[i] != static_cast<float>(agree ? stopped[i] : ends[i])) ++wrong;
    if (agree && stopped[i] != ends[i]) ++kept;
    if (!agree) ++mended;
  }
  CHECK(wrong == 0);
  CHECK(kept > values.size() / 100);
  CHECK(mended > 100);
}

TEST_CASE("in double precision the values are those of double orbits, rounded at the end") {
  const auto device =
      test::shared_device().with_lane_width(GENERATE(from_range(test::lane_widths())));
  if (!test::can_check(device, Precision::dbl)) return;
  const Map map = sliced_map();
  const surface::Grid grid = exact_grid();
  const surface::GridBlock block{{3, 2, 1}, {41, 37, 45}};
  const surface::LevelSet set(device, map, kLevelStops, 4, Precision::dbl);
  const auto values = set.over(grid, block);
  const auto points = points_of(grid, block, map.dynamics.slice);
  const auto expected = Field(device, map, Precision::dbl, kLevelStops).decided_at(points, 4);
  const auto single = surface::LevelSet(device, map, kLevelStops, 4).over(grid, block);
  std::size_t wrong = 0, finer = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i] != static_cast<float>(expected[i])) ++wrong;
    if (values[i] != single[i]) ++finer;
  }
  CHECK(wrong == 0);
  CHECK(finer > values.size() / 10);
}

TEST_CASE("a block has the values that the whole grid has there") {
  const auto device = test::shared_device();
  const Map map = sliced_map();
  surface::Grid grid = exact_grid();
  grid.origin = {-1.4999, -0.6345, -0.67777};
  grid.step = 0.061;
  grid.points = {47, 20, 22};
  const surface::LevelSet set(device, map, kLevelStops, 4);
  const auto whole = set.over(grid, surface::slices(grid, 0, grid.points[2]));
  const surface::GridBlock block{{46, 3, 7}, {1, 14, 13}};
  const auto part = set.over(grid, block);
  std::size_t index = 0;
  for (int k = 0; k < 13; ++k) {
    for (int j = 0; j < 14; ++j) {
      const int at = ((7 + k) * grid.points[1] + 3 + j) * grid.points[0] + 46;
      REQUIRE(part[index++] == whole[static_cast<std::size_t>(at)]);
    }
  }
}

TEST_CASE("maps without stop radii are iterated to the end") {
  const auto device = test::shared_device();
  const Map map = sliced_map();
  const StopRadii none{0, std::numeric_limits<double>::infinity(), 20};
  const surface::Grid grid = exact_grid();
  const surface::GridBlock block = surface::slices(grid, 20, 3);
  const auto values = surface::LevelSet(device, map, none, 3).over(grid, block);
  const auto expected = Field(device, map).at(points_of(grid, block, map.dynamics.slice), 3);
  for (std::size_t i = 0; i < values.size(); ++i) {
    REQUIRE(static_cast<double>(values[i]) == expected[i]);
  }
}

TEST_CASE("bounds of F_1 over a cube hold at every point in it") {
  const auto device =
      test::shared_device().with_lane_width(GENERATE(from_range(test::lane_widths())));
  // Centres near the slice and large exponents: cubes hold singularities, and slopes are steep.
  const double scale = GENERATE(1.0, 20.0);
  Map map = sliced_map();
  for (Factor& factor : map.dynamics.factors) factor.exponent *= scale;
  map.dynamics.factors[2].center.w = map.dynamics.slice;
  const surface::LevelSet set(device, map, kLevelStops, 1);
  std::mt19937_64 bits(4);
  for (const double reach : {0.5, 0.1, 0.01, 0.001}) {
    std::vector<Eigen::Vector3d> centers;
    for (int i = 0; i < 300; ++i) {
      const auto at = [&bits] { return static_cast<float>(test::uniform(bits, -1.8, 1.8)); };
      centers.emplace_back(at(), at(), at());
    }
    const surface::FieldBounds bounds = set.bounds(centers, reach);
    REQUIRE(bounds.low.size() == centers.size());
    // Corners first, then anywhere.
    constexpr std::size_t kTrials = 40;
    std::vector<Eigen::Vector3d> points;
    for (std::size_t i = 0; i < centers.size(); ++i) {
      for (std::size_t trial = 0; trial < kTrials; ++trial) {
        const auto offset = [&](unsigned axis) {
          const double corner = (trial >> axis & 1U) != 0 ? reach : -reach;
          return static_cast<float>(trial < 8 ? corner : test::uniform(bits, -reach, reach));
        };
        points.push_back(centers[i] + Eigen::Vector3d(offset(0), offset(1), offset(2)));
      }
    }
    const std::vector<float> values = set.at(points);
    std::size_t beyond = 0;
    std::size_t tight = 0;
    for (std::size_t i = 0; i < centers.size(); ++i) {
      const auto first = values.begin() + static_cast<std::ptrdiff_t>(i * kTrials);
      const auto [least, greatest] = std::minmax_element(first, first + kTrials);
      if (*least < bounds.low[i] || *greatest > bounds.high[i]) ++beyond;
      if (bounds.high[i] - bounds.low[i] < 1.5F * (*greatest - *least)) ++tight;
    }
    CAPTURE(reach, scale);
    CHECK(beyond == 0);
    // They are worth having: hardly wider than the field's range once cubes are small, but where
    // the field jumps at the escape radius.
    if (reach <= 0.01) CHECK(tight > centers.size() / 2);
  }
}
