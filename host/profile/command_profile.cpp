#include "qjulia/command_profile.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "profile/kernel_work.hpp"
#include "profile/limits.hpp"
#include "profile/roof.hpp"

namespace qjulia {

using namespace profiling;
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

std::vector<KernelShare> kernel_shares(const Trace& trace,
                                       const std::map<std::string, KernelWork>& work,
                                       const Roofs& roofs) {
  std::map<std::string, KernelShare> by_name;
  double sum = 0;
  for (const Trace::Event& e : trace.events()) {
    if (e.row == Trace::Row::host) continue;
    KernelShare& kernel = by_name[std::string(e.name)];
    ++kernel.launches;
    kernel.seconds += to_seconds(e.length);
    sum += to_seconds(e.length);
  }
  std::vector<KernelShare> kernels;
  for (auto& [name, kernel] : by_name) {
    kernel.kernel = name;
    kernel.share = sum > 0 ? kernel.seconds / sum : 0;
    if (const auto found = work.find(name); found != work.end()) kernel.work = found->second;
    const Roof roof = roof_of(kernel.work, kernel.seconds, roofs);
    kernel.limit = roof.limit;
    kernel.share_of_limit = roof.share;
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

nlohmann::json number_or_null(double value) {
  return value > 0 ? nlohmann::json(value) : nlohmann::json(nullptr);
}

}  // namespace

struct LaunchCounter::Impl {
  WorkCounter counter;
  device::WatchedLaunches watched{counter};
};

LaunchCounter::LaunchCounter() : impl_(std::make_unique<Impl>()) {}
LaunchCounter::~LaunchCounter() = default;
std::map<std::string, KernelWork> LaunchCounter::work() const { return impl_->counter.work(); }

Roofs measure_roofs(const Device& device) {
  constexpr int kRuns = 3;
  Roofs roofs;
  roofs.fma_per_second = measure_fma(device, Precision::single, kRuns);
  if (device.info().has_double) {
    roofs.double_fma_per_second = measure_fma(device, Precision::dbl, kRuns);
  }
  roofs.bytes_per_second = measure_copy(device, Precision::single, kRuns);
  return roofs;
}

CommandProfile command_profile(const DeviceInfo& device, const Trace& trace,
                               const std::map<std::string, KernelWork>& work, const Roofs& roofs,
                               double seconds) {
  CommandProfile profile;
  profile.device = device;
  profile.seconds = seconds;
  profile.roofs = roofs;
  const std::vector<Span> busy = busy_spans(trace);
  for (const auto& [from, to] : busy) profile.device_seconds += to_seconds(to - from);
  profile.kernels = kernel_shares(trace, work, roofs);
  profile.stages = stage_shares(trace, busy);
  return profile;
}

nlohmann::json to_json(const CommandProfile& profile) {
  nlohmann::json kernels = nlohmann::json::array(), stages = nlohmann::json::array();
  for (const KernelShare& k : profile.kernels) {
    kernels.push_back(
        {{"kernel", k.kernel},
         {"launches", k.launches},
         {"seconds", k.seconds},
         {"share", k.share},
         {"slots", number_or_null(k.work.slots)},
         {"memory_bytes", number_or_null(k.work.bytes)},
         {"work_is_at_most", k.work.at_most},
         {"precision", k.work.is_double ? "double" : "single"},
         {"limit", k.limit.empty() ? nlohmann::json(nullptr) : nlohmann::json(k.limit)},
         {"share_of_limit",
          k.share_of_limit ? nlohmann::json(*k.share_of_limit) : nlohmann::json(nullptr)}});
  }
  for (const StageShare& s : profile.stages) {
    stages.push_back({{"stage", s.stage},
                      {"times", s.times},
                      {"seconds", s.seconds},
                      {"device_seconds", s.device_seconds}});
  }
  return {{"device",
           {{"name", profile.device.name},
            {"platform", profile.device.platform_name},
            {"driver", profile.device.driver_version},
            {"compute_units", profile.device.compute_units}}},
          {"seconds", profile.seconds},
          {"device_seconds", profile.device_seconds},
          {"host_seconds", profile.seconds - profile.device_seconds},
          {"limits",
           {{"fma_per_second", profile.roofs.fma_per_second},
            {"double_fma_per_second", number_or_null(profile.roofs.double_fma_per_second)},
            {"bytes_per_second", profile.roofs.bytes_per_second}}},
          {"kernels", kernels},
          {"stages", stages}};
}

std::string to_text(const CommandProfile& profile) {
  std::string text = fmt::format(
      "{:.2f} s, of which a kernel ran for {:.2f} s and the host alone for {:.2f} s\n"
      "limits: {:.4g} G multiply-adds/s, {:.4g} G in double precision, copy {:.4g} GB/s\n"
      "{:24} {:>8} {:>9} {:>7} {:>10} {:>9}  {:>9}",
      profile.seconds, profile.device_seconds, profile.seconds - profile.device_seconds,
      1e-9 * profile.roofs.fma_per_second, 1e-9 * profile.roofs.double_fma_per_second,
      1e-9 * profile.roofs.bytes_per_second, "kernel", "launches", "seconds", "share", "Gslots",
      "GB", "of limit");
  for (const KernelShare& k : profile.kernels) {
    const std::string slots =
        k.work.slots > 0 ? fmt::format("{}{:.3g}", k.work.at_most ? "<" : "", 1e-9 * k.work.slots)
                         : std::string("-");
    const std::string bytes =
        k.work.bytes > 0 ? fmt::format("{:.3g}", 1e-9 * k.work.bytes) : std::string("-");
    const std::string share =
        k.share_of_limit
            ? fmt::format("{}{:.1f} %", k.work.at_most ? "<" : "", 100 * *k.share_of_limit)
            : std::string("-");
    text += fmt::format("\n{:24} {:8} {:9.3f} {:5.1f} % {:>10} {:>9}  {:>9} {}", k.kernel,
                        k.launches, k.seconds, 100 * k.share, slots, bytes, share, k.limit);
  }
  text += fmt::format("\n{:24} {:>8} {:>9} {:>20}", "stage of the host", "times", "seconds",
                      "with a kernel s");
  for (const StageShare& s : profile.stages) {
    text +=
        fmt::format("\n{:24} {:8} {:9.3f} {:20.3f}", s.stage, s.times, s.seconds, s.device_seconds);
  }
  return text;
}

}  // namespace qjulia
