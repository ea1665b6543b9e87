// Changing the shell without changing the shape; details by words.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <limits>

#include "map/reference_iteration.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/detail.hpp"
#include "qjulia/mesh/radial_spread.hpp"
#include "random_maps.hpp"
#include "shapes.hpp"

using namespace qjulia;

namespace {

Map map_with_detail() {
  Map map = test::random_map(12, 0.5, 1.5, 41);
  map.dynamics.factors[0].exponent += 6;
  map.dynamics.surface_level = 0.37;
  map.frame.detail = 0.02;
  return map;
}

std::vector<Quaternion> points() {
  std::vector<Quaternion> result;
  for (const auto& x : test::random_samples(200, 42).position) {
    result.push_back({x.x(), x.y(), x.z(), 0.1});
  }
  return result;
}

}  // namespace

TEST_CASE("another detail scales F_1 about the surface level, which stays") {
  const Map map = map_with_detail();
  const Map thin = with_detail(map, 0.005);
  CHECK(thin.frame.detail == 0.005);
  CHECK(thin.dynamics.surface_level == map.dynamics.surface_level);
  const auto before = reference::field(map, points(), 1, 1e9);
  const auto after = reference::field(thin, points(), 1, 1e9);
  for (std::size_t i = 0; i < before.size(); ++i) {
    // F − L is four times as large everywhere: zero, the surface, where it was zero.
    CHECK(after[i] - 0.37 == Catch::Approx(4 * (before[i] - 0.37)).margin(1e-11));
  }
  const Map back = with_detail(thin, 0.02);
  CHECK(back.dynamics.log_scale == Catch::Approx(map.dynamics.log_scale));
  CHECK(back.dynamics.degree() == Catch::Approx(map.dynamics.degree()));
}

TEST_CASE("a phase changes the iterates and keeps F_1") {
  const Map map = map_with_detail();
  Map turned = map;
  turned.dynamics.phase = {0.6, 0, 0.8, 0};
  CHECK(reference::field(map, points(), 1, 1e9) == reference::field(turned, points(), 1, 1e9));
  CHECK(reference::field(map, points(), 2, 1e9) != reference::field(turned, points(), 2, 1e9));
}

TEST_CASE("details that cannot be are refused, and the message says what can") {
  const Map map = map_with_detail();
  CHECK_THROWS_WITH(with_detail(map, 0.02 * map.dynamics.degree() * 1.01),
                    Catch::Matchers::ContainsSubstring("use less than"));
  CHECK_NOTHROW(with_detail(map, 0.02 * map.dynamics.degree() * 0.99));
  CHECK_THROWS_AS(with_detail(map, 0), InputError);
  CHECK_THROWS_AS(with_detail(map, -1), InputError);
  CHECK_THROWS_AS(with_detail(map, std::nan("")), InputError);
  Map unknown = map;
  unknown.frame.detail.reset();
  CHECK_THROWS_WITH(with_detail(unknown, 0.02), Catch::Matchers::ContainsSubstring("detail"));
}

/// ∫ A (1 − A) d ln r by random directions, for a shape that every ray from the origin leaves once.
template <class RadiusAlong>
double spread_by_rays(const RadiusAlong& radius_along) {
  std::vector<double> log_radii;
  for (const auto& x : test::random_samples(40000, 7).position) {
    if (x.norm() > 1.5) continue;  // even directions
    log_radii.push_back(std::log(radius_along(Eigen::Vector3d(x.normalized()))));
  }
  std::ranges::sort(log_radii);
  double sum = 0;  // of |ln r − ln r'| / 2 over pairs
  const auto count = static_cast<double>(log_radii.size());
  for (std::size_t i = 0; i < log_radii.size(); ++i) {
    sum += log_radii[i] * (2 * static_cast<double>(i) + 1 - count);
  }
  return sum / (count * count);
}

TEST_CASE("the spread of a shape's radii is that of rays to its surface, in any unit") {
  const Eigen::Vector3d middle(0, 0, 0);
  CHECK(radial_spread(shapes::sphere(5), middle).of_log_radii < 2e-3);
  const Eigen::Vector3d half(1, 0.5, 2), off(0.3, -0.2, 0.9);
  const auto to_wall = [&](const Eigen::Vector3d& d) {
    double least = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
      const double wall = d[axis] > 0 ? half[axis] - off[axis] : -half[axis] - off[axis];
      least = std::min(least, wall / d[axis]);
    }
    return least;
  };
  const RadialSpread spread = radial_spread(shapes::box(-half, half), off);
  CHECK(spread.of_log_radii == Catch::Approx(spread_by_rays(to_wall)).epsilon(0.02));
  CHECK(spread.longest_side == Catch::Approx(4 / std::sqrt(4 + 1 + 16.0)));
  CHECK(radial_spread(shapes::box(-1e-3 * half, 1e-3 * half), 1e-3 * off).of_log_radii ==
        Catch::Approx(spread.of_log_radii));
  CHECK_THROWS_AS(radial_spread(shapes::sphere(3), Eigen::Vector3d(5, 0, 0)), InputError);
}

TEST_CASE("words give shapes with even radii more, and keep their order") {
  const auto detail = [](DetailWord word, double spread) {
    return chosen_detail(word, {spread, 0.8}, kFittedRule);
  };
  CHECK(detail(DetailWord::automatic, 0) == Catch::Approx(0.03));
  CHECK(detail(DetailWord::automatic, 0.1) == Catch::Approx(0.48 / 256 * 0.8 / std::pow(0.1, 1.2)));
  CHECK(chosen_detail(DetailWord::automatic, {0.2, 0.8}, kExactRule) ==
        Catch::Approx(0.35 / 256 * 0.8 / 0.2));
  for (const double spread : {0.0, 0.1, 1.0}) {
    const double automatic = detail(DetailWord::automatic, spread);
    CHECK(detail(DetailWord::smooth, spread) == Catch::Approx(automatic / 8));
    CHECK(detail(DetailWord::clear, spread) == Catch::Approx(automatic / 2));
    CHECK(detail(DetailWord::wild, spread) == Catch::Approx(2 * automatic));
  }
  CHECK(chosen_detail(0.037, {1, 1}, kFittedRule) == 0.037);
}

TEST_CASE("choices are written as they are given") {
  CHECK(to_string(DetailChoice()) == "auto");
  CHECK(to_string(DetailWord::smooth) == "smooth");
  CHECK(to_string(DetailWord::clear) == "clear");
  CHECK(to_string(DetailWord::wild) == "wild");
  CHECK(to_string(0.02) == "0.02");
}
