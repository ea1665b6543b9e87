#include "profile/limits.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

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

namespace {

/// Bytes of this host's caches by level, each as large as the system says; 0 where it does not.
std::array<std::size_t, 3> cache_bytes() {
  std::array<std::size_t, 3> bytes{};
#ifdef _SC_LEVEL1_DCACHE_SIZE
  constexpr std::array kNames{_SC_LEVEL1_DCACHE_SIZE, _SC_LEVEL2_CACHE_SIZE, _SC_LEVEL3_CACHE_SIZE};
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    bytes[i] = static_cast<std::size_t>(std::max(0L, ::sysconf(kNames[i])));
  }
#endif
  return bytes;
}

}  // namespace

std::vector<CacheRoof> measure_caches(const Device& device, int repeats,
                                      const WorkerClockPointer& clock) {
  std::vector<CacheRoof> roofs;
  if (device.info().kind != DeviceKind::cpu) return roofs;
  constexpr std::size_t kReads = 12;  // QJ_READS of limits.cl
  device::Context& context = device.context();
  const std::size_t units = std::max(1U, device.info().compute_units);
  const int width = device.info().native_float_lanes > 8 ? 16 : 8;
  const std::size_t block = kReads * static_cast<std::size_t>(width) * sizeof(float);
  const std::array<std::size_t, 3> caches = cache_bytes();
  std::size_t nearer = 0;
  for (std::size_t level = 0; level < caches.size(); ++level) {
    // Half of the cache, of which the third level is shared by all processors.
    const std::size_t own = caches[level] / (level == 2 ? 2 * units : 2) / block * block;
    if (own <= nearer) continue;
    nearer = caches[level];
    constexpr std::size_t kBytesAnItem = std::size_t{1} << 28;
    const std::size_t rounds = std::max<std::size_t>(32, kBytesAnItem / own);
    const std::size_t items = 2 * units, vectors = own / (block / kReads);
    const auto from = context.upload<float>(std::vector<float>(items * own / sizeof(float)));
    const auto sums = context.allocate_real(items, Precision::single);
    const double all = static_cast<double>(items) * static_cast<double>(own * rounds);
    const auto read = [&] {
      context.launch(context.kernel("limits.cl", "read_reals", {width, Precision::single, {}}),
                     {{items, 1, 1}, {1, 1, 1}},
                     {from, device::narrow(vectors), device::narrow(rounds), sums},
                     device::kNotCounted);
    };
    const Pace pace = best_of(repeats, [&] { return paced(device, all, clock, read); });
    roofs.push_back({static_cast<int>(level) + 1, pace.per_second, pace.per_cpu_second});
  }
  return roofs;
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
  return {fma.per_second,
          in_double.per_second,
          copy.per_second,
          fma.per_cpu_second,
          in_double.per_cpu_second,
          copy.per_cpu_second,
          measure_caches(device, kRuns, clock)};
}

Roofs roofs_at(const Roofs& roofs, const Pace& pace, Precision precision) {
  Roofs now = roofs;
  const bool is_double = precision == Precision::dbl;
  const double slower =
      pace.per_second / (is_double ? roofs.double_fma_per_second : roofs.fma_per_second);
  now.fma_per_second *= slower;
  now.double_fma_per_second *= slower;
  const double before = is_double ? roofs.double_fma_per_cpu_second : roofs.fma_per_cpu_second;
  const double cpu_slower = before > 0 ? pace.per_cpu_second / before : 0;
  now.fma_per_cpu_second *= cpu_slower;
  now.double_fma_per_cpu_second *= cpu_slower;
  return now;
}

}  // namespace qjulia::profiling
