/// Bounds of ratios hold as often as they say, whatever the noise is like.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <random>

#include "benchmark/ratio_bounds.hpp"

using namespace qjulia::benchmark;

namespace {

/// How often bounds of two samples of `runs` each, of one distribution, lie beside 1.
struct Misses {
  double above = 0, below = 0;
};

template <class Draw>
Misses misses(std::size_t runs, double error, int trials, Draw draw) {
  Misses misses;
  for (int i = 0; i < trials; ++i) {
    std::vector<double> before, after;
    for (std::size_t k = 0; k < runs; ++k) before.push_back(draw());
    for (std::size_t k = 0; k < runs; ++k) after.push_back(draw());
    const auto bounds = ratio_bounds(before, after, error);
    REQUIRE(bounds);
    CHECK(bounds->low <= bounds->estimate);
    CHECK(bounds->estimate <= bounds->high);
    if (bounds->low > 1) misses.above += 1.0 / trials;
    if (bounds->high < 1) misses.below += 1.0 / trials;
  }
  return misses;
}

}  // namespace

TEST_CASE("the chances of Mann and Whitney are those of all orders") {
  // C(10, 5) = 252 orders, of which 1, 1, 2, 3 have U = 0, 1, 2, 3.
  CHECK(mann_whitney_chance(5, 5, 0) == Catch::Approx(1.0 / 252));
  CHECK(mann_whitney_chance(5, 5, 1) == Catch::Approx(2.0 / 252));
  CHECK(mann_whitney_chance(5, 5, 3) == Catch::Approx(7.0 / 252));
  CHECK(mann_whitney_chance(3, 4, 5) == mann_whitney_chance(4, 3, 5));
  CHECK(mann_whitney_chance(3, 4, 5) + mann_whitney_chance(3, 4, 6) == Catch::Approx(1));
  CHECK(mann_whitney_chance(3, 4, 12) == 1);
  // Where the normal distribution takes over, it agrees.
  const double exact = mann_whitney_chance(50, 50, 1000);
  const double normal = mann_whitney_chance(50, 51, 1020);
  CHECK(exact == Catch::Approx(0.0426).margin(0.0005));
  CHECK(normal == Catch::Approx(exact).margin(0.002));
}

TEST_CASE("bounds miss as rarely as they say, under normal and under skewed noise") {
  std::mt19937_64 random(7);
  constexpr int kTrials = 4000;
  for (const double error : {0.05, 0.00625}) {
    const double allowed = error + 3 * std::sqrt(error / kTrials);
    for (const std::size_t runs : {5U, 12U}) {
      CAPTURE(error, runs);
      std::normal_distribution<double> normal(1, 0.01);
      std::lognormal_distribution<double> skewed(0, 0.5);
      const Misses quiet = misses(runs, error, kTrials, [&] { return normal(random); });
      const Misses noisy = misses(runs, error, kTrials, [&] { return 1 + skewed(random); });
      for (const double share : {quiet.above, quiet.below, noisy.above, noisy.below}) {
        CHECK(share <= allowed);
      }
      // Nor are they so wide that they would never miss.
      if (error == 0.05) CHECK(quiet.above > 0.2 * error);
    }
  }
}

TEST_CASE("a ratio is found between its bounds, which shrink with more runs") {
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(1, 0.01);
  constexpr int kTrials = 200;
  double last_width = 1;
  for (const std::size_t runs : {5U, 20U, 60U}) {
    int held = 0;
    double width = 0, mean = 0;
    for (int trial = 0; trial < kTrials; ++trial) {
      std::vector<double> before, after;
      for (std::size_t i = 0; i < runs; ++i) {
        before.push_back(0.2 * noise(random));
        after.push_back(0.3 * noise(random));
      }
      const auto bounds = ratio_bounds(before, after, 0.01);
      REQUIRE(bounds);
      held += bounds->low <= 1.5 && 1.5 <= bounds->high ? 1 : 0;
      width += (bounds->high - bounds->low) / kTrials;
      mean += bounds->estimate / kTrials;
    }
    CHECK(held >= 0.95 * kTrials);  // of 98 % at least, in the long run
    CHECK(mean == Catch::Approx(1.5).epsilon(0.002));
    CHECK(width < last_width);
    last_width = width;
  }
  CHECK(last_width < 0.03);
}

TEST_CASE("too few runs have no bounds") {
  const std::vector<double> four{1, 2, 3, 4};
  CHECK_FALSE(ratio_bounds(four, four, 0.01));  // 1 of 70 orders is more
  CHECK(ratio_bounds(four, four, 0.02));
  CHECK_FALSE(ratio_bounds({}, four, 0.1));
}
