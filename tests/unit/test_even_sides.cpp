// Sides of the slice: the fit stays, the set off the slice becomes more even.

#include <catch2/catch.hpp>
#include <cmath>

#include "fit/even_sides.hpp"
#include "map/reference_iteration.hpp"
#include "random_maps.hpp"

using namespace qjulia;

namespace {

/// A random map whose centres lie off the slice and whose F rises outwards, thanks to a root at the
/// origin.
RationalMap rising_map(std::size_t count, double exponent, std::uint64_t seed) {
  auto map = test::random_map(count, 0.5 * exponent, exponent, seed);
  map.surface_level = -0.3;
  for (Factor& factor : map.factors) factor.center.w *= 8;
  map.factors.push_back({{0, 0, 0, 0}, 0.2 * exponent * static_cast<double>(count)});
  return map;
}

}  // namespace

TEST_CASE("moving centres across the slice keeps F_1 on it and evens what lies off it") {
  auto map = rising_map(40, 0.5, 7);
  map.slice = GENERATE(0.0, 0.05);
  const auto even = fitting::with_even_sides(map);

  std::vector<Quaternion> on_slice;
  for (const auto& x : test::random_samples(50, 3).position) {
    on_slice.push_back({x.x(), x.y(), x.z(), map.slice});
  }
  const auto before = reference::field(map, on_slice, 1, 20);
  const auto after = reference::field(even, on_slice, 1, 20);
  for (std::size_t i = 0; i < before.size(); ++i) CHECK(after[i] == Approx(before[i]));

  auto one_side = map;
  for (Factor& factor : one_side.factors) {
    factor.center.w = map.slice + std::abs(factor.center.w - map.slice);
  }
  CHECK(fitting::unevenness(even) < fitting::unevenness(one_side));
  CHECK(fitting::unevenness(even) < fitting::unevenness(map));
  std::size_t moved = 0;
  for (std::size_t k = 0; k < even.factors.size(); ++k) {
    const Quaternion& c = even.factors[k].center;
    CHECK(c.x == map.factors[k].center.x);
    CHECK(std::abs(c.w - map.slice) == Approx(std::abs(map.factors[k].center.w - map.slice)));
    moved += c.w != map.factors[k].center.w ? 1 : 0;
  }
  CHECK(moved > 0);
}

TEST_CASE("two equal roots are evenest on opposite sides") {
  RationalMap map;
  map.factors = {{{0, 0, 0, 0.4}, 1.5}, {{0, 0, 0, 0.4}, 1.5}};
  const auto even = fitting::with_even_sides(map);
  CHECK(even.factors[0].center.w * even.factors[1].center.w == Approx(-0.16));
  CHECK(fitting::unevenness(even) < 0.8 * fitting::unevenness(map));
}

TEST_CASE("a map as even as sides can make it stays as it is") {
  const auto even = fitting::with_even_sides(rising_map(20, 3, 8));
  const auto again = fitting::with_even_sides(even);
  for (std::size_t k = 0; k < even.factors.size(); ++k) {
    CHECK(again.factors[k].center == even.factors[k].center);
  }
  // Many strong factors, whose sides were drawn: what begins with all on one side ends above them.
  const auto drawn = rising_map(5000, 0.6, 1);
  CHECK(fitting::unevenness(fitting::with_even_sides(drawn)) <= fitting::unevenness(drawn));
}
