// The profile: its work is what it says, and a slower kernel is found.

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "profile/roofline.hpp"
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

TEST_CASE("the roofline has every kernel whose work is known, beneath its roof") {
  const Plot plot = roofline(report());
  REQUIRE(plot.series.size() == 3);
  const PlotSeries& slope = plot.series[0];
  const PlotSeries& roof = plot.series[1];
  const PlotSeries& kernels = plot.series[2];
  // Both roofs meet where the work per byte is what the device can do of both.
  CHECK(slope.x.back() == roof.x.front());
  CHECK(slope.y.back() == Approx(roof.y.front()));
  CHECK(slope.y.front() / slope.x.front() == Approx(slope.y.back() / slope.x.back()));
  CHECK(slope.y.back() * 1e9 == Approx(report().limits.fma_per_second));
  CHECK(slope.x.back() * report().limits.bytes_per_second ==
        Approx(report().limits.fma_per_second));
  REQUIRE(kernels.names.size() == 6);  // energy and gradient twice, Gauss-Newton, level set
  for (std::size_t i = 0; i < kernels.x.size(); ++i) {
    CHECK(kernels.y[i] <=
          1.2 * std::min(roof.y[0], kernels.x[i] * slope.y.back() / slope.x.back()));
  }
  CHECK_NOTHROW(draw_plot(plot));

  const KernelFigures& energy = figures("energy", 1);
  CHECK(energy.slots == 3000.0 * 40 * 13);  // |d|², the logarithm, the term
  CHECK(energy.memory_bytes == 3000.0 * 8 * 4);
  CHECK(*energy.share_of_limit ==
        Approx(*energy.slots / energy.median_seconds / report().limits.fma_per_second));
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
