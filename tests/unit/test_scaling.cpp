// The law of cost against size.

#include <catch2/catch_all.hpp>
#include <cmath>

#include "qjulia/profile/scaling.hpp"

using namespace qjulia;

TEST_CASE("a power law is found, and how far its points lie from it") {
  std::vector<ScalingPoint> points;
  for (const std::size_t samples : {1000U, 20'000U, 500'000U}) {
    for (const std::size_t factors : {80U, 300U, 1300U}) {
      const double seconds = 3e-9 * std::pow(samples, 0.9) * std::pow(factors, 1.1);
      points.push_back({4, samples, factors, seconds, 0});
    }
  }
  ScalingLaw law = fit_law(points);
  CHECK(law.iterations == 4);
  CHECK(law.samples_exponent == Catch::Approx(0.9));
  CHECK(law.factors_exponent == Catch::Approx(1.1));
  CHECK(law.worst_ratio == Catch::Approx(1));
  points[4].seconds *= 2;
  law = fit_law(points);
  // In the middle of the grid: the plane rises by a ninth of ln 2.
  CHECK(law.worst_ratio == Catch::Approx(std::pow(2, 8.0 / 9)).epsilon(0.05));
}
