#include "profile/limits.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "device/context.hpp"
#include "profile/workload.hpp"

namespace qjulia::profiling {
namespace {

/// Seconds on the device: the fastest of `repeats` runs, after one that is not counted.
double least_seconds(const Device& device, int repeats, const std::function<void()>& run) {
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= repeats; ++i) {
    const KernelSeconds seconds = timed(device, run);
    if (i > 0) least = std::min(least, seconds.device);
  }
  return least;
}

}  // namespace

int widest_lanes(const Device& device, Precision precision) {
  constexpr int kWidest = 16;
  return device.info().kind == DeviceKind::cpu ? kWidest : device.lane_width(precision);
}

std::function<double()> fma_probe(const Device& device, Precision precision) {
  constexpr double kChains = 16;  // QJ_CHAINS of limits.cl
  device::Context& context = device.context();
  const int width = widest_lanes(device, precision);
  // Lanes on CPUs come from the vector, on GPUs from very many work-items.
  const std::size_t items = width == 1 ? std::size_t{1} << 18 : 256;
  const int rounds = width == 1 ? 2048 : 40'000;
  const auto seed = context.upload_real(std::array{0.999, 0.001}, precision);
  const auto sums = context.allocate_real(items, precision);
  return [=, &context] {
    const KernelSeconds seconds = timed(device, [&] {
      context.launch(context.kernel("limits.cl", "fma_chains", {width, precision, {}}),
                     {{items, 1, 1}}, {seed, rounds, sums});
    });
    return kChains * rounds * static_cast<double>(items) * width / seconds.device;
  };
}

double measure_fma(const Device& device, Precision precision, int repeats) {
  const auto probe = fma_probe(device, precision);
  probe();
  double best = 0;
  for (int i = 0; i < repeats; ++i) best = std::max(best, probe());
  return best;
}

double measure_copy(const Device& device, Precision precision, int repeats) {
  device::Context& context = device.context();
  const int width = device.lane_width(precision);
  const auto lanes = static_cast<std::size_t>(width);
  constexpr std::size_t kCopyBytes = std::size_t{1} << 28;  // 256 MiB
  const std::size_t real_bytes = device::real_bytes(precision);
  const std::size_t reals =
      std::min<std::size_t>(kCopyBytes, context.info().largest_allocation / 4) / real_bytes;
  const std::size_t vectors = width == 1 ? 1 : 256;
  const std::size_t copy_items = reals / (vectors * lanes);
  const auto from = context.allocate_real(reals, precision);
  const auto to = context.allocate_real(reals, precision);
  const double seconds = least_seconds(device, repeats, [&] {
    context.launch(context.kernel("limits.cl", "copy_reals", {width, precision, {}}),
                   {{copy_items, 1, 1}},
                   {from, device::narrow(vectors), device::narrow(copy_items), to});
  });
  return 2 * static_cast<double>(copy_items * vectors * lanes * real_bytes) / seconds;
}

DeviceLimits measure_limits(const Device& device, Precision precision, int repeats) {
  device::Context& context = device.context();
  const DeviceInfo& info = context.info();
  DeviceLimits limits;
  limits.fma_per_second = measure_fma(device, precision, repeats);
  const int width = widest_lanes(device, precision);
  if (width > 1) {
    constexpr double kMega = 1e6;
    limits.clock_fma_per_second = kMega * info.clock_mhz * info.compute_units * width;
  }
  limits.bytes_per_second = measure_copy(device, precision, repeats);
  const auto from = context.allocate_real(1, precision);
  limits.launch_seconds = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 20 * repeats; ++i) {
    const auto run = timed(device, [&] {
      context.launch(
          context.kernel("limits.cl", "no_work", {device.lane_width(precision), precision, {}}),
          {{1, 1, 1}}, {from});
    });
    limits.launch_seconds = std::min(limits.launch_seconds, run.wall);
  }
  return limits;
}

}  // namespace qjulia::profiling
