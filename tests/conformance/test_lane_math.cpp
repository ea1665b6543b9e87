// The kernels' elementary functions, swept against the host's at each lane width and precision.
// Every bound is what lane_math.clh states.

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "device/context.hpp"
#include "random_maps.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

/// Functions of lane_math_probe.cl by their numbers.
enum Function { log2_of = 0, exp_of, tanh_of, angle_of, sine_of, cosine_of, rsqrt_of, sum_of };

class Probe {
 public:
  Probe(int width, Precision precision)
      : device_(test::shared_device().with_lane_width(width)),
        width_(static_cast<std::size_t>(width)),
        precision_(precision) {}

  /// The function at x (and y), whose number is a multiple of 16.
  std::vector<double> operator()(Function function, const std::vector<double>& x,
                                 const std::vector<double>& y) const {
    auto& context = device_.context();
    const auto kernel = context.kernel("lane_math_probe.cl", "lane_math_probe",
                                       {static_cast<int>(width_), precision_, {}});
    const std::size_t groups = x.size() / width_;
    const auto out = context.allocate_real(x.size(), precision_);
    context.launch(kernel, {{groups, 1, 1}},
                   {context.upload_real(x, precision_), context.upload_real(y, precision_),
                    static_cast<std::int32_t>(groups), static_cast<std::int32_t>(function), out});
    std::vector<double> values(x.size());
    context.read(out, values);
    return values;
  }

  /// x as the device sees it.
  double rounded(double x) const {
    return precision_ == Precision::single ? static_cast<double>(static_cast<float>(x)) : x;
  }

 private:
  Device device_;
  std::size_t width_;
  Precision precision_;
};

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
template <class Exact, class Scale>
double worst(const Probe& probe, Function function, const std::vector<double>& x,
             const std::vector<double>& y, Exact exact, Scale scale) {
  const auto values = probe(function, x, y);
  double error = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double right = exact(probe.rounded(x[i]), probe.rounded(y[i]));
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
  const Probe probe(width, precision);
  const ErrorBounds bound = bounds(precision);
  CAPTURE(width, precision == Precision::dbl);

  const auto log2 = [](double x, double) { return std::log2(x); };
  const auto near_one = even(0.7, 1.5);
  CHECK(worst(probe, log2_of, near_one, near_one, log2,
              [](double v) { return std::max(std::abs(v), 1e-30); }) < bound.log2_near_one);
  const auto all = powers_of_two(-125, 127);
  CHECK(worst(probe, log2_of, all, all, log2, mixed) < bound.log2_mixed);

  const auto exp = [](double x, double) { return std::exp(x); };
  const auto moderate = even(-4, 4);
  CHECK(worst(probe, exp_of, moderate, moderate, exp, relative) < bound.exp_moderate);
  const auto full = even(-87, 88);
  CHECK(worst(probe, exp_of, full, full, exp, relative) < bound.exp_full);

  const auto tanh = [](double x, double) { return std::tanh(x); };
  const auto wide = even(-50, 50);
  CHECK(worst(probe, tanh_of, wide, wide, tanh, absolute) < bound.tanh_absolute);
  CHECK(worst(probe, tanh_of, moderate, moderate, tanh, absolute) < bound.tanh_absolute);

  const auto sine = [](double x, double) { return std::sin(x); };
  const auto cosine = [](double x, double) { return std::cos(x); };
  for (const auto& x : {even(-1000, 1000), even(-7, 7)}) {
    CHECK(worst(probe, sine_of, x, x, sine, absolute) < bound.sincos);
    CHECK(worst(probe, cosine_of, x, x, cosine, absolute) < bound.sincos);
  }

  const auto rsqrt = [](double x, double) { return 1 / std::sqrt(x); };
  CHECK(worst(probe, rsqrt_of, all, all, rsqrt, relative) < bound.rsqrt);
}

TEST_CASE("angles are right all round, at every size and on the axes") {
  const int width = GENERATE(from_range(test::lane_widths()));
  const auto precision = GENERATE(Precision::single, Precision::dbl);
  if (!test::can_check(test::shared_device(), precision)) return;
  const Probe probe(width, precision);
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
  const auto angle = [](double r, double x) { return std::atan2(r, x); };
  CHECK(worst(probe, angle_of, rho, a, angle, absolute) < bounds(precision).angle);
}

TEST_CASE("lanes are summed, each once") {
  const int width = GENERATE(from_range(test::lane_widths()));
  const Probe probe(width, Precision::single);
  std::vector<double> x(64);
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = std::exp2(static_cast<double>(i % 16));
  const auto sums = probe(sum_of, x, x);
  const auto lanes = static_cast<std::size_t>(width);
  for (std::size_t i = 0; i < x.size(); ++i) {
    double expected = 0;
    for (std::size_t j = 0; j < lanes; ++j) expected += x[i / lanes * lanes + j];
    CHECK(sums[i] == expected);
  }
}
