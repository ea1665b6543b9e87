#include <algorithm>
#include <array>

#include "base/larger_error.hpp"
#include "check/checks.hpp"
#include "check/lane_probe.hpp"
#include "device/context.hpp"
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
       device::narrow(kBlock), sums});
  context.read(sums, found);
  return largest_difference(found, right);
}

/// Copied reals, and a sum of chains of multiply-adds.
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
                 {context.upload_real(seed, precision), kRounds, sums});
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
                 {context.upload_real(numbers, precision), 2, 3, to});
  context.read(to, copied);
  return larger_error(largest_difference(found, {right}), largest_difference(copied, numbers));
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

constexpr std::array kDeviceChecks{
    Check{"limits.cl", "copies and multiply-adds", 1e-6, 1e-14, limits},
    Check{"lane_math_probe.cl", "elementary functions, with the host's", 1e-6, 1e-14, lane_math},
    Check{"reduce.cl", "sums of whole numbers", 0, 0, reduced, true},
};

}  // namespace

std::span<const Check> device_checks() { return kDeviceChecks; }

}  // namespace qjulia::check
