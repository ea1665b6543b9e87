// Poles inside the shape and roots outside: where they are, and off the slice.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <limits>
#include <vector>

#include "energy/evaluator.hpp"
#include "fit/misplaced.hpp"
#include "sphere_pool.hpp"

using namespace qjulia;
using test::small_level;

namespace {

/// Signed, from the unit sphere.
std::vector<double> distances_of(const Map& map) {
  std::vector<double> result;
  for (const auto& x : fitting::points_at_centers(map)) result.push_back(x.norm() - 1);
  return result;
}

std::vector<double> field_at(const energy::Samples& samples, const Map& map) {
  return energy::make_reference_evaluator(samples, {})->field(map);
}

}  // namespace

TEST_CASE("poles inside and roots outside, beyond the band, have one-sided samples") {
  const fitting::Level level = small_level();
  Map map;
  // The others are where they belong (the first far off the slice), within the band, without
  // effect or nowhere.
  const double nan = std::numeric_limits<double>::quiet_NaN();
  map.dynamics.factors = {{{0, 0, 0, 0.05}, -2},  {{0, 0, 0, 1.5}, 2},     {{0, 0, 0.95, 0.01}, -2},
                          {{0, 1.5, 0, 0.1}, -2}, {{0, 1.5, 0, -0.05}, 2}, {{0, 0, 0, 0.1}, 0},
                          {{nan, 0, 0, 0.1}, -2}};
  const auto [samples, factors] = fitting::misplaced_factors(map, distances_of(map), level);
  REQUIRE(samples.size() == 14);
  REQUIRE(factors.size() == 14);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const bool is_pole = i < 7;
    CHECK(factors[i] == (is_pole ? 0 : 4));
    const Eigen::Vector3d center = is_pole ? Eigen::Vector3d(0, 0, 0) : Eigen::Vector3d(0, 1.5, 0);
    CHECK((samples.position[i] - center).norm() == Catch::Approx(i % 7 == 0 ? 0 : 0.05));
    CHECK(std::ranges::count(samples.position, samples.position[i]) == 1);
    CHECK(samples.side[i] == (is_pole ? -1 : 1));
    CHECK(samples.target[i] == samples.side[i] * level.band);
    CHECK(samples.weight[i] == Catch::Approx(10.0 / 7 / level.samples));
    CHECK(samples.off_slice[i] == 0);
  }
}

TEST_CASE("a misplaced centre in the slice has samples beside it alone") {
  Map map;
  map.dynamics.factors = {{{0, 0, 0, 0}, -2}};
  const auto [samples, factors] = fitting::misplaced_factors(map, distances_of(map), small_level());
  REQUIRE(samples.size() == 6);
  for (const auto& x : samples.position) CHECK(x.norm() == Catch::Approx(1e-5));
}

TEST_CASE("a misplaced factor is lifted as far as its samples ask, and no other moves") {
  const fitting::Level level = small_level();
  Map map;
  // F = ln |x| on the slice, but for a pole inside and a root outside; the next does no harm, and
  // the last could do none.
  map.dynamics.slice = 0.25;
  map.dynamics.factors = {{{0, 0, 0, 0.25}, 1},
                          {{0.3, -0.4, 0, 0.23}, -0.5},
                          {{0, 0, 1.8, 0.26}, 0.2},
                          {{0, -1.8, 0, 0.35}, 1e-3},
                          {{0.3, -0.4, 0, 0.26}, -1e-3}};  // in the first pole's hole
  const auto found = fitting::misplaced_factors(map, distances_of(map), level);
  const auto before = field_at(found.samples, map);
  REQUIRE(before[0] > 0);  // a hole
  const auto lifted = fitting::lifted(map, found, before);
  REQUIRE(lifted);
  CHECK(lifted->dynamics.factors[0].center == map.dynamics.factors[0].center);
  CHECK(lifted->dynamics.factors[3].center == map.dynamics.factors[3].center);
  CHECK(lifted->dynamics.factors[4].center == map.dynamics.factors[4].center);
  CHECK(lifted->dynamics.factors[1].center.w < 0.2);
  CHECK(lifted->dynamics.factors[2].center.w > 0.27);
  const auto after = field_at(found.samples, *lifted);
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < found.factors.size(); ++i) {
    if (found.samples.side[i] * before[i] >= 0) continue;
    least = std::min(least, found.samples.side[i] * (after[i] - found.samples.target[i]));
  }
  CHECK(least == Catch::Approx(0).margin(0.02));  // each has a little of the other's move
  CHECK_FALSE(fitting::lifted(*lifted, found, after));
}
