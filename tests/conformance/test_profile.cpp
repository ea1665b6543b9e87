// The profile: its work is what it says, and a slower kernel is found.

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "profile/workload.hpp"
#include "qjulia/error.hpp"
#include "qjulia/profile.hpp"

using namespace qjulia;

namespace {

ProfileOptions small() {
  ProfileOptions options;
  options.samples = 3000;
  options.factors = 40;
  options.repeats = 2;
  return options;
}

const ProfileReport& report() {
  static const ProfileReport made = profile(Device::choose(), small());
  return made;
}

const KernelFigures& figures(const std::string& kernel, int n) {
  const auto found = std::ranges::find_if(
      report().kernels, [&](const auto& f) { return f.kernel == kernel && f.iterations == n; });
  REQUIRE(found != report().kernels.end());
  return *found;
}

}  // namespace

TEST_CASE("the workload is the one described") {
  const Workload work = make_workload(small());
  REQUIRE(work.samples.size() == 3000);
  REQUIRE(work.map.factors.size() == 40);
  std::size_t roots = 0;
  for (const Factor& f : work.map.factors) {
    roots += f.exponent > 0 ? 1 : 0;
    CHECK(std::abs(f.exponent) >= 0.01);
    CHECK(std::abs(f.exponent) <= 0.06);
  }
  CHECK(roots == 23);  // 57 % of 40, rounded up
  for (const auto& x : work.samples.position) CHECK(x.cwiseAbs().maxCoeff() <= 1.5);
}

TEST_CASE("energy and gradient run every iterate of every sample") {
  for (const int n : {1, 4}) {
    for (const char* kernel : {"energy", "gradient"}) {
      const KernelFigures& f = figures(kernel, n);
      CHECK(f.executed_factor_iterations == 3000.0 * 40 * n);
      CHECK(f.pairs_per_second == Approx(3000.0 * 40 * n / f.median_seconds));
      CHECK(f.min_seconds > 0);
      CHECK(f.min_seconds <= f.median_seconds);
      // Kernels run within the wall clock's time.
      CHECK(f.min_seconds <= f.wall_seconds);
      // No kernel beats the limit, and none is a hundred times slower.
      CHECK(*f.share_of_limit > 0.01);
      CHECK(*f.share_of_limit < 1.2);
    }
  }
  CHECK(figures("gradient", 1).median_seconds > figures("energy", 1).median_seconds);
  for (const char* kernel : {"gauss_newton", "distance", "level_set", "ray_march"}) {
    CHECK(std::ranges::count(report().kernels, kernel, &KernelFigures::kernel) == 1);
  }
}

TEST_CASE("a kernel slower than its baseline is named") {
  nlohmann::json baseline = to_json(report());
  CHECK(regressions(report(), baseline, 0).empty());
  auto& energy = baseline["kernels"][0];
  energy["median_seconds"] = energy["median_seconds"].get<double>() / 2;
  const auto slower = regressions(report(), baseline, 0.5);
  REQUIRE(slower.size() == 1);
  CHECK_THAT(slower[0], Catch::Contains("energy, n = 1") && Catch::Contains("2.00 times"));
  CHECK(regressions(report(), baseline, 1.1).empty());
}

TEST_CASE("a baseline that cannot be compared is refused") {
  CHECK_THROWS_AS(regressions(report(), nlohmann::json::array(), 0.1), InputError);
  nlohmann::json other = to_json(report());
  for (auto& kernel : other["kernels"]) kernel["samples"] = 5;
  CHECK_THROWS_WITH(regressions(report(), other, 0.1), Catch::Contains("same size"));
}

TEST_CASE("profile options name what is wrong") {
  ProfileOptions options = small();
  options.factors = 2;
  CHECK_THROWS_WITH(options.validate(), Catch::Contains("--factors 2"));
  options = small();
  options.lane_width = 3;
  CHECK_THROWS_WITH(options.validate(), Catch::Contains("--width 3"));
}
