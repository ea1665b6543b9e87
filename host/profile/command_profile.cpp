#include "profile/command_profile.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "profile/code_sampler.hpp"
#include "profile/explain.hpp"
#include "profile/json_values.hpp"
#include "profile/limits.hpp"
#include "profile/processor_watch.hpp"
#include "profile/roof.hpp"
#include "profile/work_counter.hpp"
#include "profile/worker_clock.hpp"

namespace qjulia::profiling {

namespace {

using Span = std::pair<std::int64_t, std::int64_t>;  ///< nanoseconds, from … to

/// Those in which any kernel ran, in order and apart.
std::vector<Span> busy_spans(const Trace& trace) {
  std::vector<Span> all, apart;
  for (const Trace::Event& e : trace.events()) {
    if (e.row != Trace::Row::host) all.emplace_back(e.start, e.start + e.length);
  }
  std::ranges::sort(all);
  for (const Span& span : all) {
    if (!apart.empty() && span.first <= apart.back().second) {
      apart.back().second = std::max(apart.back().second, span.second);
    } else {
      apart.push_back(span);
    }
  }
  return apart;
}

/// Nanoseconds of `spans` within one.
std::int64_t within(const std::vector<Span>& spans, Span whole) {
  std::int64_t sum = 0;
  auto at = std::ranges::upper_bound(spans, whole.first, {}, &Span::second);
  for (; at != spans.end() && at->first < whole.second; ++at) {
    sum += std::min(at->second, whole.second) - std::max(at->first, whole.first);
  }
  return sum;
}

double to_seconds(std::int64_t nanoseconds) { return 1e-9 * static_cast<double>(nanoseconds); }

/// CPU seconds of each kernel; empty where they are not known.
std::map<std::string, double> cpu_by_kernel(const Trace& trace,
                                            const std::vector<CommandMeasure::Cpu>& cpu,
                                            unsigned processors) {
  using std::chrono::nanoseconds;
  std::map<std::string, double> by_name;
  if (cpu.empty()) return by_name;
  std::vector<CpuSample> samples;
  samples.reserve(cpu.size());
  for (const auto& [time, seconds] : cpu) {
    samples.push_back({Trace::Clock::time_point(nanoseconds(time)), seconds});
  }
  std::vector<std::string_view> names;
  std::vector<KernelSpan> spans;
  for (const Trace::Event& e : trace.events()) {
    if (e.row == Trace::Row::host) continue;
    names.push_back(e.name);
    spans.push_back({Trace::Clock::time_point(nanoseconds(e.start)), nanoseconds(e.length)});
  }
  const std::vector<double> seconds = cpu_seconds_of(spans, samples, processors);
  for (std::size_t i = 0; i < names.size(); ++i) by_name[std::string(names[i])] += seconds[i];
  return by_name;
}

/// The interval between the shares by the limits before and after the command.
Interval with_limit_before(double share, const Roof& roof, bool has_cpu,
                           const CommandMeasure& measure) {
  const double before = has_cpu ? measure.fma_per_cpu_second_before : measure.fma_per_second_before;
  const double after = has_cpu ? measure.roofs.fma_per_cpu_second : measure.roofs.fma_per_second;
  if (roof.limit != "fma" || !(before > 0) || !(after > 0)) return {share, share, share};
  const double other = share * after / before;
  return {std::min(share, other), std::sqrt(share * other), std::max(share, other)};
}

std::vector<KernelShare> kernel_shares(const Trace& trace,
                                       const std::map<std::string, KernelWork>& work,
                                       const CommandMeasure& measure, unsigned processors) {
  std::map<std::string, KernelShare> by_name;
  double sum = 0;
  for (const Trace::Event& e : trace.events()) {
    if (e.row == Trace::Row::host) continue;
    KernelShare& kernel = by_name[std::string(e.name)];
    ++kernel.launches;
    kernel.seconds += to_seconds(e.length);
    sum += to_seconds(e.length);
  }
  const std::map<std::string, double> cpu = cpu_by_kernel(trace, measure.cpu, processors);
  const bool is_busy = measure.waited_share && *measure.waited_share > kUsualWait;
  std::vector<KernelShare> kernels;
  for (auto& [name, kernel] : by_name) {
    kernel.kernel = name;
    kernel.share = sum > 0 ? kernel.seconds / sum : 0;
    if (const auto found = work.find(name); found != work.end()) kernel.work = found->second;
    if (const auto found = cpu.find(name); found != cpu.end()) kernel.cpu_seconds = found->second;
    const Spent spent{kernel.seconds, kernel.cpu_seconds.value_or(0)};
    const Roof roof = roof_of(kernel.work, spent, measure.roofs);
    std::optional<Interval> shares;
    if (roof.share) {
      shares = with_limit_before(*roof.share, roof, spent.cpu_seconds > 0, measure);
    }
    const auto mix = measure.instructions.find(name);
    if (mix != measure.instructions.end()) kernel.instructions = mix->second;
    const InstructionMix* const code = kernel.instructions ? &*kernel.instructions : nullptr;
    const auto bounds = bounds_of(code, measure.roofs, kernel.work.is_double);
    const JudgedShare found = judged(roof.limit, kernel.work.at_most, shares, is_busy, bounds);
    kernel.limit = roof.limit;
    kernel.share_of_limit = found.share;
    kernel.share_low = found.low;
    kernel.share_high = found.high;
    kernel.share_verdict = found.verdict;
    kernel.sizes = kernel.work.sizes;
    kernel.limited_by =
        limited_by(kernel.work, spent, found, {measure.roofs, code, 0, measure.use});
    kernels.push_back(std::move(kernel));
  }
  std::ranges::stable_sort(kernels, std::greater<>(), &KernelShare::seconds);
  return kernels;
}

std::vector<StageShare> stage_shares(const Trace& trace, const std::vector<Span>& busy) {
  std::map<std::string, StageShare> by_name;
  for (const Trace::Event& e : trace.events()) {
    if (e.row != Trace::Row::host) continue;
    StageShare& stage = by_name[std::string(e.name)];
    stage.stage = e.name;
    ++stage.times;
    stage.seconds += to_seconds(e.length);
    stage.device_seconds += to_seconds(within(busy, {e.start, e.start + e.length}));
  }
  std::vector<StageShare> stages;
  stages.reserve(by_name.size());
  for (auto& [name, stage] : by_name) stages.push_back(std::move(stage));
  std::ranges::stable_sort(stages, std::greater<>(), &StageShare::seconds);
  return stages;
}

/// A share in per cent with its interval, or why there is none.
std::string share_text(const KernelShare& k) {
  if (!k.share_of_limit) return verdict_text(k.share_verdict, k.share_low, k.share_high);
  return fmt::format(
      "{}{:.1f} %{}", k.work.at_most ? "<" : "", 100 * *k.share_of_limit,
      *k.share_high > *k.share_low
          ? fmt::format(" ({:.1f} to {:.1f})", 100 * *k.share_low, 100 * *k.share_high)
          : std::string());
}

}  // namespace

struct LaunchCounter::Impl {
  WorkCounter counter;
  device::WatchedLaunches watched{counter};
};

LaunchCounter::LaunchCounter() : impl_(std::make_unique<Impl>()) {}
LaunchCounter::~LaunchCounter() = default;
std::map<std::string, KernelWork> LaunchCounter::work() const { return impl_->counter.work(); }

Roofs measure_roofs(const Device& device) { return measure_roofs(device, worker_clock(device)); }

struct CommandMeter::Impl {
  Impl(const Device& of, const std::stop_token& stop)
      : device(of),
        clock(worker_clock(of)),
        before(measure_fma(of, Precision::single, 3, clock, stop)) {}

  Device device;
  WorkerClockPointer clock;
  Pace before;
  std::optional<CpuSampler> sampler;
  std::optional<WaitedShare> waited;
  ProcessorWatch processors;
  std::optional<CodeSampler> code;
};

CommandMeter::CommandMeter(const Device& device, const std::stop_token& stop)
    : impl_(std::make_unique<Impl>(device, stop)) {
  if (!impl_->clock) return;
  impl_->sampler.emplace(impl_->clock);
  impl_->waited.emplace(impl_->clock);
  impl_->processors = ProcessorWatch();
  impl_->code.emplace(impl_->clock);
}

CommandMeter::~CommandMeter() = default;

CommandMeasure CommandMeter::finish(Trace::Clock::time_point trace_began) const {
  CommandMeasure measure;
  measure.fma_per_second_before = impl_->before.per_second;
  measure.fma_per_cpu_second_before = impl_->before.per_cpu_second;
  if (impl_->sampler) {
    for (const CpuSample& sample : impl_->sampler->samples()) {
      measure.cpu.push_back({(sample.time - trace_began).count(), sample.seconds});
    }
    measure.waited_share = impl_->waited->so_far();
    measure.use = impl_->processors.so_far();
    KernelMixes found = impl_->code->mixes();
    measure.instructions = std::move(found.mixes);
    measure.no_instructions = std::move(found.problem);
  }
  measure.roofs = measure_roofs(impl_->device, impl_->clock);
  return measure;
}

CommandProfile command_profile(const DeviceInfo& device, const Trace& trace,
                               const std::map<std::string, KernelWork>& work,
                               const CommandMeasure& measure, double seconds) {
  CommandProfile profile;
  profile.device = device;
  profile.seconds = seconds;
  profile.measure = measure;
  const std::vector<Span> busy = busy_spans(trace);
  for (const auto& [from, to] : busy) profile.device_seconds += to_seconds(to - from);
  profile.kernels = kernel_shares(trace, work, measure, device.compute_units);
  profile.stages = stage_shares(trace, busy);
  return profile;
}

std::vector<std::string> CommandProfile::disturbances() const {
  const double after = measure.roofs.fma_per_second;
  const double before = measure.fma_per_second_before;
  return signs_of_load(before > 0 ? before : after, after, measure.waited_share, measure.use);
}

nlohmann::json to_json(const CommandProfile& profile) {
  const Roofs& roofs = profile.measure.roofs;
  nlohmann::json kernels = nlohmann::json::array(), stages = nlohmann::json::array();
  for (const KernelShare& k : profile.kernels) {
    kernels.push_back({{"kernel", k.kernel},
                       {"launches", k.launches},
                       {"seconds", k.seconds},
                       {"cpu_seconds", or_null(k.cpu_seconds)},
                       {"share", k.share},
                       {"slots", positive_or_null(k.work.slots)},
                       {"memory_bytes", positive_or_null(k.work.bytes)},
                       {"work_is_at_most", k.work.at_most},
                       {"sizes", or_null(k.sizes)},
                       {"precision", k.work.is_double ? "double" : "single"},
                       {"limit", or_null(k.limit)},
                       {"share_of_limit", or_null(k.share_of_limit)},
                       {"share_low", or_null(k.share_low)},
                       {"share_high", or_null(k.share_high)},
                       {"share_verdict", or_null(k.share_verdict)},
                       {"instruction_mix", or_null(k.instructions)},
                       {"limited_by", or_null(k.limited_by)}});
  }
  for (const StageShare& s : profile.stages) {
    stages.push_back({{"stage", s.stage},
                      {"times", s.times},
                      {"seconds", s.seconds},
                      {"device_seconds", s.device_seconds}});
  }
  return {
      {"device",
       {{"name", profile.device.name},
        {"platform", profile.device.platform_name},
        {"driver", profile.device.driver_version},
        {"compute_units", profile.device.compute_units}}},
      {"seconds", profile.seconds},
      {"device_seconds", profile.device_seconds},
      {"host_seconds", profile.seconds - profile.device_seconds},
      {"limits",
       {{"fma_per_second", roofs.fma_per_second},
        {"fma_per_second_before", positive_or_null(profile.measure.fma_per_second_before)},
        {"double_fma_per_second", positive_or_null(roofs.double_fma_per_second)},
        {"bytes_per_second", roofs.bytes_per_second},
        {"fma_per_cpu_second", positive_or_null(roofs.fma_per_cpu_second)},
        {"fma_per_cpu_second_before", positive_or_null(profile.measure.fma_per_cpu_second_before)},
        {"double_fma_per_cpu_second", positive_or_null(roofs.double_fma_per_cpu_second)},
        {"bytes_per_cpu_second", positive_or_null(roofs.bytes_per_cpu_second)},
        {"caches", to_json(roofs.caches)}}},
      {"waited_share", or_null(profile.measure.waited_share)},
      {"processor_use", or_null(profile.measure.use)},
      {"disturbances", profile.disturbances()},
      {"kernels", kernels},
      {"stages", stages}};
}

std::string to_text(const CommandProfile& profile) {
  const Roofs& roofs = profile.measure.roofs;
  std::string text = fmt::format(
      "{:.2f} s, of which a kernel ran for {:.2f} s and the host alone for {:.2f} s\n"
      "limits in a second: {:.4g} G multiply-adds, {:.4g} G in double precision, copy {:.4g} "
      "GB/s{}\n",
      profile.seconds, profile.device_seconds, profile.seconds - profile.device_seconds,
      1e-9 * roofs.fma_per_second, 1e-9 * roofs.double_fma_per_second,
      1e-9 * roofs.bytes_per_second, cache_rates(roofs.caches));
  if (roofs.fma_per_cpu_second > 0) {
    text += fmt::format(
        "limits in a CPU second, of which shares of multiply-adds are: {:.4g} G, {:.4g} G in "
        "double "
        "precision; before the command {:.4g} G\n",
        1e-9 * roofs.fma_per_cpu_second, 1e-9 * roofs.double_fma_per_cpu_second,
        1e-9 * profile.measure.fma_per_cpu_second_before);
  }
  text += fmt::format("{:24} {:>8} {:>9} {:>9} {:>7} {:>10} {:>9}  {}", "kernel", "launches",
                      "seconds", "CPU s", "share", "Gslots", "GB", "of limit");
  for (const KernelShare& k : profile.kernels) {
    const std::string slots =
        k.work.slots > 0 ? fmt::format("{}{:.3g}", k.work.at_most ? "<" : "", 1e-9 * k.work.slots)
                         : std::string("-");
    const std::string bytes =
        k.work.bytes > 0 ? fmt::format("{:.3g}", 1e-9 * k.work.bytes) : std::string("-");
    const std::string cpu =
        k.cpu_seconds ? fmt::format("{:.3f}", *k.cpu_seconds) : std::string("-");
    text += fmt::format("\n{:24} {:8} {:9.3f} {:>9} {:5.1f} % {:>10} {:>9}  {} {}", k.kernel,
                        k.launches, k.seconds, cpu, 100 * k.share, slots, bytes, share_text(k),
                        k.limit);
  }
  if (const std::string lines = limit_lines(profile.kernels); !lines.empty()) text += "\n" + lines;
  text += fmt::format("\n{:24} {:>8} {:>9} {:>20}", "stage of the host", "times", "seconds",
                      "with a kernel s");
  for (const StageShare& s : profile.stages) {
    text +=
        fmt::format("\n{:24} {:8} {:9.3f} {:20.3f}", s.stage, s.times, s.seconds, s.device_seconds);
  }
  return text;
}

}  // namespace qjulia::profiling

namespace qjulia {

std::string verdict_text(const std::string& verdict, const std::optional<double>& low,
                         const std::optional<double>& high) {
  if (verdict.empty()) return "-";
  if (!low || !high) return verdict;
  return fmt::format("{} ({:.1f} to {:.1f})", verdict, 100 * *low, 100 * *high);
}

std::string cache_rates(const std::vector<CacheRoof>& caches) {
  std::string text;
  for (const CacheRoof& cache : caches) {
    text += fmt::format(", L{} {:.4g} GB/s", cache.level, 1e-9 * cache.bytes_per_second);
  }
  return text;
}

}  // namespace qjulia
