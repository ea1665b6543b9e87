// Changing the shell without changing the shape; details by words.

#include <catch2/catch.hpp>
#include <cmath>

#include "map/reference_iteration.hpp"
#include "qjulia/detail.hpp"
#include "qjulia/detail_choice.hpp"
#include "qjulia/error.hpp"
#include "random_maps.hpp"
#include "shapes.hpp"

using namespace qjulia;

namespace {

RationalMap map_with_detail() {
  RationalMap map = test::random_map(12, 0.5, 1.5, 41);
  map.factors[0].exponent += 6;
  map.surface_level = 0.37;
  map.detail = 0.02;
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
  const RationalMap map = map_with_detail();
  const RationalMap thin = with_detail(map, 0.005);
  CHECK(thin.detail == 0.005);
  CHECK(thin.surface_level == map.surface_level);
  const auto before = reference::field(map, points(), 1, 1e9);
  const auto after = reference::field(thin, points(), 1, 1e9);
  for (std::size_t i = 0; i < before.size(); ++i) {
    // F − L is four times as large everywhere: zero, the surface, where it was zero.
    CHECK(after[i] - 0.37 == Approx(4 * (before[i] - 0.37)).margin(1e-11));
  }
  const RationalMap back = with_detail(thin, 0.02);
  CHECK(back.log_scale == Approx(map.log_scale));
  CHECK(back.degree() == Approx(map.degree()));
}

TEST_CASE("a phase changes the iterates and keeps F_1") {
  const RationalMap map = map_with_detail();
  RationalMap turned = map;
  turned.phase = {0.6, 0, 0.8, 0};
  CHECK(reference::field(map, points(), 1, 1e9) == reference::field(turned, points(), 1, 1e9));
  CHECK(reference::field(map, points(), 2, 1e9) != reference::field(turned, points(), 2, 1e9));
}

TEST_CASE("details that cannot be are refused, and the message says what can") {
  const RationalMap map = map_with_detail();
  CHECK_THROWS_WITH(with_detail(map, 0.02 * map.degree() * 1.01), Catch::Contains("use less than"));
  CHECK_NOTHROW(with_detail(map, 0.02 * map.degree() * 0.99));
  CHECK_THROWS_AS(with_detail(map, 0), InputError);
  CHECK_THROWS_AS(with_detail(map, -1), InputError);
  CHECK_THROWS_AS(with_detail(map, std::nan("")), InputError);
  RationalMap unknown = map;
  unknown.detail.reset();
  CHECK_THROWS_WITH(with_detail(unknown, 0.02), Catch::Contains("detail"));
}

TEST_CASE("a cube and a ball are equally thick, and thinness has no unit") {
  const double thickest = 6 * std::sqrt(3.0);
  CHECK(thinness(shapes::box({-1, 2, 3}, {1, 4, 5})) == Approx(thickest));
  CHECK(thinness(shapes::box({0, 0, 0}, {1e-3, 1e-3, 1e-3})) == Approx(thickest));
  CHECK(thinness(shapes::sphere(5)) == Approx(thickest).epsilon(2e-3));
  // Sides 1, 1, 10: diagonal √102, area 42, volume 10.
  CHECK(thinness(shapes::box({0, 0, 0}, {1, 1, 10})) == Approx(std::sqrt(102.0) * 4.2));
}

TEST_CASE("words give thick shapes two per cent, thin ones less, and keep their order") {
  const auto detail = [](DetailWord word, double thin) {
    return chosen_detail(word, thin, kFittedShare);
  };
  CHECK(detail(DetailWord::automatic, 10.3) == Approx(0.02));
  CHECK(detail(DetailWord::automatic, 17.1) == Approx(0.02));
  CHECK(detail(DetailWord::automatic, 22.5) == Approx(0.0165).epsilon(0.01));    // the koala
  CHECK(detail(DetailWord::automatic, 19.3) == Approx(0.02));                    // the bunny
  CHECK(detail(DetailWord::automatic, 34.1) == Approx(0.00844).epsilon(0.01));   // a hand
  CHECK(detail(DetailWord::automatic, 61.2) == Approx(0.2 / 30));                // a figure
  CHECK(detail(DetailWord::automatic, 80.3) == Approx(0.2 / 30).epsilon(1e-3));  // a scorpion
  CHECK(detail(DetailWord::automatic, 360.4) == Approx(0.2 / 150).epsilon(1e-3));
  CHECK(chosen_detail(DetailWord::automatic, 10.3, kExactShare) == Approx(0.02));
  CHECK(chosen_detail(DetailWord::automatic, 19.3, kExactShare) == Approx(0.0135).epsilon(0.01));
  CHECK(chosen_detail(DetailWord::automatic, 61.2, kExactShare) == Approx(0.004));
  for (const double thin : {10.4, 30.0, 1000.0}) {
    const double automatic = detail(DetailWord::automatic, thin);
    CHECK(detail(DetailWord::smooth, thin) == Approx(automatic / 8));
    CHECK(detail(DetailWord::clear, thin) == Approx(automatic / 2));
    CHECK(detail(DetailWord::wild, thin) == Approx(2 * automatic));
  }
  CHECK(chosen_detail(0.037, 1e9, kFittedShare) == 0.037);
}

TEST_CASE("choices are written as they are given") {
  CHECK(to_string(DetailChoice()) == "auto");
  CHECK(to_string(DetailWord::smooth) == "smooth");
  CHECK(to_string(DetailWord::clear) == "clear");
  CHECK(to_string(DetailWord::wild) == "wild");
  CHECK(to_string(0.02) == "0.02");
}
