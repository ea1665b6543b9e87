// The kernels' elementary functions, swept against the host's at each lane width and precision.
// Every bound is what lane_math.clh states.

#include <catch2/catch_all.hpp>
#include <cmath>
#include <numbers>

#include "check/lane_probe.hpp"
#include "random_maps.hpp"
#include "test_device.hpp"

using namespace qjulia;
using check::LaneFunction;
using check::LaneProbe;

namespace {

std::size_t points() { return test::sweep_size(std::size_t{1} << 17U); }

std::vector<double> even(double low, double high) {
  std::vector<double> x(points());
  for (std::size_t i = 0; i < x.size(); ++i) {
    x[i] = low + (high - low) * static_cast<double>(i) / static_cast<double>(x.size() - 1);
  }
  return x;
}

std::vector<double> powers_of_two(double low, double high) {
  auto x = even(low, high);
  for (double& v : x) v = std::exp2(v);
  return x;
}

/// Largest |device − host| / scale(host) over the sweep.
template <class Scale>
double worst(const LaneProbe& probe, LaneFunction function, const std::vector<double>& x,
             const std::vector<double>& y, Scale scale) {
  const auto values = probe(function, x, y);
  double error = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double right = check::on_host(function, probe.rounded(x[i]), probe.rounded(y[i]));
    const double e = std::abs(values[i] - right) / scale(right);
    if (!(e <= error)) error = e;  // NaN is kept
  }
  return error;
}

double absolute(double) { return 1; }
double relative(double v) { return std::abs(v); }
/// Absolute below 1, relative above.
double mixed(double v) { return std::max(1.0, std::abs(v)); }

struct ErrorBounds {
  double log2_near_one, log2_mixed, exp_moderate, exp_full, tanh_absolute, angle, sincos, rsqrt;
};

/// float: as lane_math.clh states; double: OpenCL's own functions, a few units in the last place.
ErrorBounds bounds(Precision precision) {
  return precision == Precision::single
             ? ErrorBounds{3.5e-7, 1.3e-7, 1.2e-7, 1.2e-7, 2e-7, 4e-7, 8e-8, 2.4e-7}
             : ErrorBounds{2e-15, 2e-15, 2e-15, 2e-15, 1e-15, 2e-15, 1e-15, 2e-15};
}

}  // namespace

TEST_CASE("elementary functions keep their stated bounds") {
  const int width = GENERATE(from_range(test::lane_widths()));
  const auto precision = GENERATE(Precision::single, Precision::dbl);
  if (!test::can_check(test::shared_device(), precision)) return;
  const LaneProbe probe(test::shared_device(), width, precision);
  const ErrorBounds bound = bounds(precision);
  CAPTURE(width, precision == Precision::dbl);

  const auto near_one = even(0.7, 1.5);
  CHECK(worst(probe, LaneFunction::log2, near_one, near_one,
              [](double v) { return std::max(std::abs(v), 1e-30); }) < bound.log2_near_one);
  const auto all = powers_of_two(-125, 127);
  CHECK(worst(probe, LaneFunction::log2, all, all, mixed) < bound.log2_mixed);

  const auto moderate = even(-4, 4);
  CHECK(worst(probe, LaneFunction::exp, moderate, moderate, relative) < bound.exp_moderate);
  const auto full = even(-87, 88);
  CHECK(worst(probe, LaneFunction::exp, full, full, relative) < bound.exp_full);

  const auto wide = even(-50, 50);
  CHECK(worst(probe, LaneFunction::tanh, wide, wide, absolute) < bound.tanh_absolute);
  CHECK(worst(probe, LaneFunction::tanh, moderate, moderate, absolute) < bound.tanh_absolute);

  for (const auto& x : {even(-1000, 1000), even(-7, 7)}) {
    CHECK(worst(probe, LaneFunction::sine, x, x, absolute) < bound.sincos);
    CHECK(worst(probe, LaneFunction::cosine, x, x, absolute) < bound.sincos);
  }

  CHECK(worst(probe, LaneFunction::rsqrt, all, all, relative) < bound.rsqrt);
}

TEST_CASE("angles are right all round, at every size and on the axes") {
  const int width = GENERATE(from_range(test::lane_widths()));
  const auto precision = GENERATE(Precision::single, Precision::dbl);
  if (!test::can_check(test::shared_device(), precision)) return;
  const LaneProbe probe(test::shared_device(), width, precision);
  CAPTURE(width, precision == Precision::dbl);
  std::mt19937_64 bits(1);
  std::vector<double> rho(points());
  std::vector<double> a(points());
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double t = std::numbers::pi * static_cast<double>(i) / static_cast<double>(a.size() - 1);
    const double size = std::exp2(test::uniform(bits, -40, 40));
    rho[i] = size * std::max(0.0, std::sin(t));
    a[i] = size * std::cos(t);
  }
  for (const auto& [r, x] : {std::pair{0.0, 1.0},
                             {0.0, -1.0},
                             {1.0, 0.0},
                             {1.0, 1.0},
                             {1.0, -1.0},
                             {1e-15, -1.0},
                             {1e-15, 1.0},
                             {1e-15, 1e-12}}) {
    rho.push_back(r);
    a.push_back(x);
  }
  rho.resize(points() + 16, 1);
  a.resize(points() + 16, 1);
  CHECK(worst(probe, LaneFunction::angle, rho, a, absolute) < bounds(precision).angle);
}

TEST_CASE("lanes are summed, each once") {
  const int width = GENERATE(from_range(test::lane_widths()));
  const LaneProbe probe(test::shared_device(), width, Precision::single);
  std::vector<double> x(64);
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = std::exp2(static_cast<double>(i % 16));
  const auto sums = probe(LaneFunction::sum, x, x);
  const auto lanes = static_cast<std::size_t>(width);
  for (std::size_t i = 0; i < x.size(); ++i) {
    double expected = 0;
    for (std::size_t j = 0; j < lanes; ++j) expected += x[i / lanes * lanes + j];
    CHECK(sums[i] == expected);
  }
}
