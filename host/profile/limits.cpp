#include "profile/limits.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <limits>

#include "device/context.hpp"
#include "profile/stopwatch.hpp"

namespace qjulia::profiling {
namespace {

constexpr double kChains = 16;                            // QJ_CHAINS of limits.cl
constexpr std::size_t kCopyBytes = std::size_t{1} << 28;  // 256 MiB

double best(const Device& device, int repeats, const std::function<void()>& run) {
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= repeats; ++i) {
    const KernelSeconds seconds = timed(device, run);
    if (i > 0) least = std::min(least, seconds.device);
  }
  return least;
}

}  // namespace

double measure_fma(const Device& device, Precision precision, int repeats) {
  device::Context& context = device.context();
  const int width = device.lane_width(precision);
  // Lanes on CPUs come from the vector, on GPUs from very many work-items.
  const std::size_t items = width == 1 ? std::size_t{1} << 18 : 256;
  const int rounds = width == 1 ? 2048 : 40'000;
  const auto seed = context.upload_real(std::array{0.999, 0.001}, precision);
  const auto sums = context.allocate_real(items, precision);
  const double fma_seconds = best(device, repeats, [&] {
    context.launch(context.kernel("limits.cl", "fma_chains", {width, precision, {}}),
                   {{items, 1, 1}}, {seed, rounds, sums});
  });
  return kChains * rounds * static_cast<double>(items) * width / fma_seconds;
}

DeviceLimits measure_limits(const Device& device, Precision precision, int repeats) {
  device::Context& context = device.context();
  const int width = device.lane_width(precision);
  const auto lanes = static_cast<std::size_t>(width);
  const auto kernel = [&](const char* name) {
    return context.kernel("limits.cl", name, {width, precision, {}});
  };
  DeviceLimits limits;
  limits.fma_per_second = measure_fma(device, precision, repeats);
  const DeviceInfo& info = context.info();
  if (width > 1) {
    constexpr double kMega = 1e6;
    limits.clock_fma_per_second = kMega * info.clock_mhz * info.compute_units * width;
  }

  const std::size_t real_bytes = precision == Precision::dbl ? 8 : 4;
  const std::size_t reals =
      std::min<std::size_t>(kCopyBytes, context.info().largest_allocation / 4) / real_bytes;
  const std::size_t vectors = width == 1 ? 1 : 256;
  const std::size_t copy_items = reals / (vectors * lanes);
  const auto from = context.allocate_real(reals, precision);
  const auto to = context.allocate_real(reals, precision);
  const double copy_seconds = best(device, repeats, [&] {
    context.launch(
        kernel("copy_reals"), {{copy_items, 1, 1}},
        {from, static_cast<std::int32_t>(vectors), static_cast<std::int32_t>(copy_items), to});
  });
  limits.bytes_per_second =
      2 * static_cast<double>(copy_items * vectors * lanes * real_bytes) / copy_seconds;

  double launch = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 20 * repeats; ++i) {
    const auto wall = timed(device, [&] {
      context.launch(kernel("no_work"), {{1, 1, 1}}, {from});
      context.finish();
    });
    launch = std::min(launch, wall.wall);
  }
  limits.launch_seconds = launch;
  return limits;
}

}  // namespace qjulia::profiling
