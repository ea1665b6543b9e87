#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/larger_error.hpp"
#include "check/checks.hpp"
#include "check/lane_probe.hpp"
#include "device/context.hpp"
#include "layout/builtins.h"
#include "profile/workload.hpp"

namespace qjulia::check {
namespace {

using base::larger_error;
using profiling::largest_difference;

/// Sums of whole numbers, which are exact.
double reduced(const Device& device, Precision precision) {
  constexpr std::size_t kRows = 70, kColumns = 37, kBlock = 32;
  constexpr std::size_t kBlocks = (kRows + kBlock - 1) / kBlock;
  std::vector<double> rows(kRows * kColumns), right(kBlocks * kColumns), found(right.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i] = static_cast<double>((i * 7) % 101) - 50;
    right[i / kColumns / kBlock * kColumns + i % kColumns] += rows[i];
  }
  device::Context& context = device.context();
  const auto sums = context.allocate_real(right.size(), precision);
  context.launch(
      context.kernel("reduce.cl", "sum_row_blocks", {device.lane_width(precision), precision, {}}),
      {{kColumns, kBlocks, 1}},
      {context.upload_real(rows, precision), device::narrow(kRows), device::narrow(kColumns),
       device::narrow(kBlock), sums},
      device::kNotCounted);
  context.read(sums, found);
  return largest_difference(found, right);
}

/// Copied reals, and sums of chains of multiply-adds, of constants and of what is read.
double limits(const Device& device, Precision precision) {
  device::Context& context = device.context();
  const int width = device.lane_width(precision);
  const auto kernel = [&](const char* name) {
    return context.kernel("limits.cl", name, {width, precision, {}});
  };
  const std::vector<double> seed{0.5, 0.25};
  constexpr std::int32_t kRounds = 3, kChains = 16;
  const auto sums = context.allocate_real(1, precision);
  context.launch(kernel("fma_chains"), {{1, 1, 1}, {1, 1, 1}},
                 {context.upload_real(seed, precision), kRounds, sums}, device::kNotCounted);
  std::vector<double> found(1);
  context.read(sums, found);
  double right = 0;
  for (int c = 0; c < kChains; ++c) {
    double chain = c;
    for (int r = 0; r < kRounds; ++r) chain = chain * seed[0] + seed[1];
    right += width * chain;
  }
  std::vector<double> numbers(static_cast<std::size_t>(width) * 6), copied(numbers.size());
  for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = static_cast<double>(i);
  const auto to = context.allocate_real(numbers.size(), precision);
  context.launch(kernel("copy_reals"), {{3, 1, 1}},
                 {context.upload_real(numbers, precision), 2, 3, to}, device::kNotCounted);
  context.read(to, copied);
  constexpr int kReadRounds = 2, kReads = 12, kTurns = 2;
  std::vector<double> read(static_cast<std::size_t>(width) * kReads * kTurns), halved(1);
  for (std::size_t i = 0; i < read.size(); ++i) read[i] = static_cast<double>(i % 7);
  context.launch(kernel("read_reals"), {{1, 1, 1}, {1, 1, 1}},
                 {context.upload_real(read, precision), kReads * kTurns, kReadRounds, sums},
                 device::kNotCounted);
  context.read(sums, halved);
  // A sum for each lane and each of kReads chains.
  const std::size_t chains = read.size() / kTurns;
  double of_read = 0;
  for (std::size_t c = 0; c < chains; ++c) {
    double chain = 0;
    for (int turn = 0; turn < kReadRounds * kTurns; ++turn) {
      chain = chain / 2 + read[c + (turn % kTurns == 0 ? 0 : chains)];
    }
    of_read += chain;
  }
  double worst =
      larger_error(largest_difference(found, {right}), largest_difference(copied, numbers));
  worst = larger_error(worst, largest_difference(halved, {of_read}));
  return worst;
}

double lane_math(const Device& device, Precision precision) {
  constexpr std::size_t kCount = 256;  // a multiple of every width
  const check::LaneProbe probe(device, device.lane_width(precision), precision);
  std::vector<double> x(kCount), right(kCount);
  for (std::size_t i = 0; i < kCount; ++i) x[i] = 0.25 + static_cast<double>(i) / 64;
  double worst = 0;
  for (const LaneFunction function : {LaneFunction::log2, LaneFunction::exp, LaneFunction::tanh,
                                      LaneFunction::sine, LaneFunction::rsqrt}) {
    std::ranges::transform(x, right.begin(),
                           [&](double v) { return check::on_host(function, v, v); });
    worst = larger_error(worst, largest_difference(probe(function, x, x), right));
  }
  return worst;
}

/// A built-in function in the arithmetic of `Real`.
/// @param x, y all that the function takes at a time: the lanes of a work-item
template <class Real>
Real builtin(int function, std::span<const Real> x, std::span<const Real> y, std::size_t i) {
  const Real u = x[i], v = y[i];
  const auto is_less = [&](std::size_t lane) { return std::isless(x[lane], y[lane]); };
  std::size_t less = 0;
  for (std::size_t lane = 0; lane < x.size(); ++lane) less += is_less(lane) ? 1 : 0;
  switch (function) {
    case QJ_BUILTIN_FMAX:
      return std::fmax(u, v);
    case QJ_BUILTIN_FMIN:
      return std::fmin(u, v);
    case QJ_BUILTIN_FMA: {
      const volatile Real product = u * v;  // rounded, whatever the compiler makes of the next line
      return std::fma(u, v, -product);
    }
    case QJ_BUILTIN_SQRT:
      return std::sqrt(u);
    case QJ_BUILTIN_RSQRT:
      return 1 / std::sqrt(u);
    case QJ_BUILTIN_ATAN:
      return std::atan(u);
    case QJ_BUILTIN_FLOOR:
      return std::floor(v);
    case QJ_BUILTIN_CONVERT:
      return std::trunc(v);
    case QJ_BUILTIN_SELECT:
      return is_less(i) ? u : v;
    case QJ_BUILTIN_ISLESS:
      return is_less(i) ? 1 : 0;
    case QJ_BUILTIN_ISGREATER:
      return std::isgreater(u, v) ? 1 : 0;
    case QJ_BUILTIN_IS_NUMBER:
      return std::isnan(v) ? 0 : 1;
    case QJ_BUILTIN_ANY:
      return less > 0 ? 1 : 0;
    case QJ_BUILTIN_ALL:
      return less == x.size() ? 1 : 0;
    case QJ_BUILTIN_HALF:
      return u / 2;
    default:
      break;
  }
  return std::numeric_limits<Real>::quiet_NaN();
}

/// What a function may differ by: sqrt, rsqrt and atan by units in the last place
/// (OpenCL 1.2, 7.4), of the largest value here; the others by nothing.
template <class Real>
double allowed(int function) {
  constexpr double kUnit = std::numeric_limits<Real>::epsilon();
  if (function == QJ_BUILTIN_SQRT) return 3 * kUnit;
  if (function == QJ_BUILTIN_RSQRT) return 2 * kUnit;
  return function == QJ_BUILTIN_ATAN ? 5 * kUnit : 0;
}

/// The largest difference of a function, over what it may be; infinite where one that must be exact
/// is not.
template <class Real>
double builtin_error(const Device& device, Precision precision, int function) {
  constexpr std::size_t kGroups = 9;
  device::Context& context = device.context();
  const int width = device.lane_width(precision);
  const auto lanes = static_cast<std::size_t>(width);
  std::vector<double> x(kGroups * lanes), y(x.size()), found(x.size()), right(x.size());
  // Positive numbers, and numbers of both signs, which are above and below them. No lane of the
  // first groups, every one of the next, and some of the others are below those of y.
  for (std::size_t i = 0; i < x.size(); ++i) {
    const std::size_t group = i / lanes;
    x[i] = static_cast<Real>(0.3 + static_cast<double>((i * 7) % 11) / 3);
    y[i] = static_cast<Real>(static_cast<double>((i * 5) % 13) / 1.7 - 3.1);
    if (group < 2) y[i] = -x[i];
    if (group == 2 || group == 3) y[i] = static_cast<Real>(x[i] + 0.7);
  }
  if (function == QJ_BUILTIN_ISLESS || function == QJ_BUILTIN_ISGREATER ||
      function == QJ_BUILTIN_IS_NUMBER) {
    for (std::size_t i = 4 * lanes; i < x.size(); i += 3) y[i] = std::nan("");
  }
  if (function == QJ_BUILTIN_HALF) {
    for (double& value : x) value *= 1.5 * std::numeric_limits<Real>::min();
  }
  const std::vector<Real> u(x.begin(), x.end()), v(y.begin(), y.end());
  for (std::size_t i = 0; i < x.size(); ++i) {
    const std::size_t first = i / lanes * lanes;
    right[i] = builtin<Real>(function, std::span(u).subspan(first, lanes),
                             std::span(v).subspan(first, lanes), i - first);
  }
  const auto out = context.allocate_real(x.size(), precision);
  context.launch(context.kernel("builtins.cl", "builtins", {width, precision, {}}),
                 {{kGroups, 1, 1}},
                 {context.upload_real(x, precision), context.upload_real(y, precision),
                  device::narrow(kGroups), static_cast<std::int32_t>(function), out},
                 device::kNotCounted);
  context.read(out, found);
  const double difference = largest_difference(found, right), most = allowed<Real>(function);
  return most > 0 ? difference / most : difference == 0 ? 0 : kInfinite;
}

/// Items that were handed a wrong number.
double exchanged(const Device& device, Precision precision) {
  constexpr std::size_t kGroups = 5;
  const std::size_t size =
      std::min<std::size_t>(device.info().largest_work_group, QJ_EXCHANGE_GROUP);
  device::Context& context = device.context();
  std::vector<std::int32_t> found(kGroups * size, -1);
  const auto out = context.upload(std::span<const std::int32_t>(found));
  context.launch(
      context.kernel("builtins.cl", "exchanged", {device.lane_width(precision), precision, {}}),
      {{found.size(), 1, 1}, {size, 1, 1}}, {out}, device::kNotCounted);
  context.read(out, std::span(found));
  double wrong = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const std::size_t first = i / size * size;
    const std::size_t before = i == first ? first + size - 1 : i - 1;
    if (found[i] != static_cast<std::int32_t>(before)) ++wrong;
  }
  return wrong;
}

/// Numbers that are too small for a full mantissa are part of double precision, but a device may
/// lack them in single precision (OpenCL 1.2, 7.5.3).
double builtins(const Device& device, Precision precision) {
  const bool is_double = precision == Precision::dbl;
  double worst = exchanged(device, precision);
  for (int function = 0; function < QJ_BUILTIN_COUNT; ++function) {
    if (function == QJ_BUILTIN_HALF && !is_double) continue;
    worst = larger_error(worst, is_double ? builtin_error<double>(device, precision, function)
                                          : builtin_error<float>(device, precision, function));
  }
  return worst;
}

constexpr std::array kDeviceChecks{
    Check{"builtins.cl", "built-in functions and groups, in what they may differ by", 1, 1,
          builtins},
    Check{"limits.cl", "copies and multiply-adds", 1e-6, 1e-14, limits},
    Check{"lane_math_probe.cl", "elementary functions, with the host's", 1e-6, 1e-14, lane_math},
    Check{"reduce.cl", "sums of whole numbers", 0, 0, reduced, true},
};

}  // namespace

std::span<const Check> device_checks() { return kDeviceChecks; }

}  // namespace qjulia::check
