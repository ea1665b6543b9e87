#include "qjulia/profile/own_launch.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cmath>

#include "base/median.hpp"
#include "device/context.hpp"
#include "profile/code_sampler.hpp"
#include "profile/explain.hpp"
#include "profile/limits.hpp"
#include "profile/processor_watch.hpp"
#include "profile/roof.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia {

using namespace profiling;

void OwnLaunch::validate() const {
  if (!run) throw OptionError("run", "there is no launch to measure; give a call");
  for (const auto& [field, value] : {std::pair("slots", slots), std::pair("bytes", bytes)}) {
    if (!(value >= 0) || !std::isfinite(value)) {
      throw OptionError(field, fmt::format("{} is out of range; give 0 or more", value));
    }
  }
  constexpr int kMostRepeats = 1000;
  if (repeats < 1 || repeats > kMostRepeats) {
    throw OptionError("repeats",
                      fmt::format("{} is out of range; give 1 to {}", repeats, kMostRepeats));
  }
}

KernelFigures profile_launch(const Device& device, const OwnLaunch& launch,
                             const ProgressMonitor& monitor) {
  using SteadyClock = std::chrono::steady_clock;
  launch.validate();
  KernelWork work;
  work.slots = launch.slots;
  work.bytes = launch.bytes;
  work.at_most = launch.at_most;
  work.is_double = launch.precision == Precision::dbl;
  const WorkerClockPointer clock = worker_clock(device);
  const WaitedShare waited(clock);
  const ProcessorWatch processors;
  const Roofs roofs = measure_roofs(device, clock);
  const auto limit_now = fma_probe(device, launch.precision, clock);

  KernelFigures f;
  f.kernel = launch.kernel;
  f.precision = launch.precision;
  f.is_one_kernel = true;
  f.launches = 1;
  f.work_is_at_most = launch.at_most;
  std::vector<MeasuredRun> runs;
  launch.run();  // builds what is built on first use, fills the caches
  for (int i = 0; i < launch.repeats; ++i) {
    throw_if_stopped(monitor.stop);
    const double cpu_before = clock ? clock->seconds() : 0;
    const auto start = SteadyClock::now();
    launch.run();
    const double seconds = std::chrono::duration<double>(SteadyClock::now() - start).count();
    const Spent spent{seconds, clock ? clock->seconds() - cpu_before : 0};
    const Pace pace = limit_now();
    runs.push_back({spent, roofs_at(roofs, pace, launch.precision)});
    f.run_seconds.push_back(spent.seconds);
    f.run_fma_per_second.push_back(pace.per_second);
    if (!clock) continue;
    f.run_cpu_seconds.push_back(spent.cpu_seconds);
    f.run_fma_per_cpu_second.push_back(pace.per_cpu_second);
  }
  f.median_seconds = f.wall_seconds = base::median(f.run_seconds);
  f.min_seconds = std::ranges::min(f.run_seconds);
  f.max_seconds = std::ranges::max(f.run_seconds);
  if (work.slots > 0) f.slots = work.slots;
  if (work.bytes > 0) f.memory_bytes = work.bytes;

  const KernelMixes found = sampled_code(clock, [&] {
    throw_if_stopped(monitor.stop);
    launch.run();
  });
  if (const auto mix = found.mixes.find(launch.kernel); mix != found.mixes.end()) {
    f.instructions = mix->second;
  }
  const InstructionMix* const mix = f.instructions ? &*f.instructions : nullptr;
  const auto share = waited.so_far();
  const bool is_busy = share && *share > kUsualWait;
  const JudgedShare judged_share = judged_runs(work, runs, is_busy, mix);
  f.limit = judged_share.limit;
  f.share_of_limit = judged_share.share;
  f.share_low = judged_share.low;
  f.share_high = judged_share.high;
  f.share_verdict = judged_share.verdict;
  f.limited_by = limited_by(work, runs.back().spent, judged_share,
                            {runs.back().roofs, mix, runs.size(), processors.so_far()});
  return f;
}

}  // namespace qjulia
