#include "profile/limits.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "device/context.hpp"
#include "profile/workload.hpp"
#include "qjulia/base/progress.hpp"

namespace qjulia::profiling {
namespace {

/// How much of `amount` a second `run` did, by both clocks.
Pace paced(const Device& device, double amount, const WorkerClockPointer& clock,
           const std::function<void()>& run) {
  const double before = clock ? clock->seconds() : 0;
  const KernelSeconds seconds = timed(device, run);
  const double cpu = clock ? clock->seconds() - before : 0;
  return {amount / seconds.device, cpu > 0 ? amount / cpu : 0};
}

/// The best of `repeats` runs by either clock, after one that is not counted.
Pace best_of(int repeats, const std::function<Pace()>& probe, const std::stop_token& stop = {}) {
  throw_if_stopped(stop);
  probe();
  Pace best;
  for (int i = 0; i < repeats; ++i) {
    throw_if_stopped(stop);
    const Pace pace = probe();
    best.per_second = std::max(best.per_second, pace.per_second);
    best.per_cpu_second = std::max(best.per_cpu_second, pace.per_cpu_second);
  }
  return best;
}

}  // namespace

int widest_lanes(const Device& device, Precision precision) {
  constexpr int kWidest = 16;
  return device.info().kind == DeviceKind::cpu ? kWidest : device.lane_width(precision);
}

WorkerClockPointer worker_clock(const Device& device) {
  const auto probe = fma_probe(device, Precision::single, nullptr);
  return WorkerClock::of(device, [&] { probe(); });
}

std::function<Pace()> fma_probe(const Device& device, Precision precision,
                                const WorkerClockPointer& clock) {
  constexpr double kChains = 16;  // QJ_CHAINS of limits.cl
  device::Context& context = device.context();
  const int width = widest_lanes(device, precision);
  // Lanes on CPUs come from the vector, on GPUs from very many work-items.
  const std::size_t items = width == 1 ? std::size_t{1} << 18 : 256;
  const int rounds = width == 1 ? 2048 : 40'000;
  const auto seed = context.upload_real(std::array{0.999, 0.001}, precision);
  const auto sums = context.allocate_real(items, precision);
  return [=, &context] {
    const double all = kChains * rounds * static_cast<double>(items) * width;
    return paced(device, all, clock, [&] {
      context.launch(context.kernel("limits.cl", "fma_chains", {width, precision, {}}),
                     {{items, 1, 1}}, {seed, rounds, sums}, device::kNotCounted);
    });
  };
}

Pace measure_fma(const Device& device, Precision precision, int repeats,
                 const WorkerClockPointer& clock, const std::stop_token& stop) {
  return best_of(repeats, fma_probe(device, precision, clock), stop);
}

Pace measure_copy(const Device& device, Precision precision, int repeats,
                  const WorkerClockPointer& clock) {
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
  const double all = 2 * static_cast<double>(copy_items * vectors * lanes * real_bytes);
  const auto copy = [&] {
    context.launch(
        context.kernel("limits.cl", "copy_reals", {width, precision, {}}), {{copy_items, 1, 1}},
        {from, device::narrow(vectors), device::narrow(copy_items), to}, device::kNotCounted);
  };
  return best_of(repeats, [&] { return paced(device, all, clock, copy); });
}

DeviceLimits measure_limits(const Device& device, Precision precision, int repeats,
                            const WorkerClockPointer& clock) {
  device::Context& context = device.context();
  const DeviceInfo& info = context.info();
  DeviceLimits limits;
  const Pace fma = measure_fma(device, precision, repeats, clock);
  limits.fma_per_second = fma.per_second;
  limits.fma_per_cpu_second = fma.per_cpu_second;
  const int width = widest_lanes(device, precision);
  if (width > 1) {
    constexpr double kMega = 1e6;
    limits.clock_fma_per_second = kMega * info.clock_mhz * info.compute_units * width;
  }
  const Pace copy = measure_copy(device, precision, repeats, clock);
  limits.bytes_per_second = copy.per_second;
  limits.bytes_per_cpu_second = copy.per_cpu_second;
  const auto from = context.allocate_real(1, precision);
  limits.launch_seconds = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 20 * repeats; ++i) {
    const auto run = timed(device, [&] {
      context.launch(
          context.kernel("limits.cl", "no_work", {device.lane_width(precision), precision, {}}),
          {{1, 1, 1}}, {from}, device::kNotCounted);
    });
    limits.launch_seconds = std::min(limits.launch_seconds, run.wall);
  }
  return limits;
}

Roofs measure_roofs(const Device& device, const WorkerClockPointer& clock) {
  constexpr int kRuns = 3;
  const Pace fma = measure_fma(device, Precision::single, kRuns, clock);
  const Pace in_double =
      device.info().has_double ? measure_fma(device, Precision::dbl, kRuns, clock) : Pace();
  const Pace copy = measure_copy(device, Precision::single, kRuns, clock);
  return {fma.per_second,     in_double.per_second,     copy.per_second,
          fma.per_cpu_second, in_double.per_cpu_second, copy.per_cpu_second};
}

}  // namespace qjulia::profiling
