#include "qjulia/profile/profile.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "base/deadline.hpp"
#include "base/median.hpp"
#include "profile/code_sampler.hpp"
#include "profile/explain.hpp"
#include "profile/interval.hpp"
#include "profile/jobs.hpp"
#include "profile/kernel_counter.hpp"
#include "profile/limits.hpp"
#include "profile/prediction.hpp"
#include "profile/roof.hpp"
#include "profile/work_counter.hpp"
#include "profile/workload.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/profile/profile_settings.hpp"

namespace qjulia {

using namespace profiling;
namespace {

using SteadyClock = std::chrono::steady_clock;

/// Collects figures, one job after the other.
class Bench {
 public:
  Bench(const Device& device, const ProfileOptions& options, ProfileReport& report,
        const Roofs& roofs, const WorkerClockPointer& clock, const ProgressMonitor& monitor,
        const base::Deadline& deadline, WorkCounter* counter, KernelCounter* events)
      : device_(device),
        options_(options),
        report_(report),
        roofs_(roofs),
        clock_(clock),
        waited_(clock),
        monitor_(monitor),
        deadline_(deadline),
        counter_(counter),
        events_(events),
        limit_now_(fma_probe(device, options.precision, clock)) {}

  /// @param jobs_left with this one; they share the time that is left.
  void time(const Job& job, std::size_t jobs_left) {
    Runs runs;
    const double left = deadline_.left();
    try {
      throw_if_stopped(deadline_.token());
      job.run(deadline_.token());  // builds the kernels, fills the caches
      const auto start = SteadyClock::now();
      for (int i = 0; i < options_.repeats; ++i) {
        throw_if_stopped(deadline_.token());
        const double spent = std::chrono::duration<double>(SteadyClock::now() - start).count();
        if (i > 0 && spent > left / static_cast<double>(jobs_left)) break;
        if (counter_ != nullptr) counter_->reset();
        runs.all.push_back(timed_by_kernel(device_, clock_, [&] { job.run(deadline_.token()); }));
        if (counter_ != nullptr) runs.work = counter_->work();
        runs.limits.push_back(limit_now_());
      }
      if (events_ != nullptr) count_events(job);
      if (counter_ != nullptr) sample_code(job);
    } catch (const Interrupted&) {
      if (events_ != nullptr) events_->reset();
      if (monitor_.stop.stop_requested()) throw;
      if (runs.all.empty()) {
        report_.left_out.push_back(
            fmt::format("{}, n = {}: it does not fit into the time", job.name, job.iterations));
        return;
      }
    }
    if (is_shown(job.name)) add_job(job, runs);
    if (counter_ != nullptr) add_kernels(job, runs);
  }

 private:
  /// One more run, after one that builds what only watched launches need.
  void count_events(const Job& job) {
    const device::WatchedLaunches watched(*events_);
    for (int i = 0; i < 2; ++i) {
      throw_if_stopped(deadline_.token());
      device_.context().finish();
      events_->reset();
      job.run(deadline_.token());
      device_.context().finish();
    }
  }

  /// More runs, until what the kernels are made of has been seen often enough.
  void sample_code(const Job& job) {
    if (!can_sample_code_) return;
    KernelMixes found = sampled_code(clock_, [&] {
      throw_if_stopped(deadline_.token());
      job.run(deadline_.token());
      device_.context().finish();
    });
    // A missing objdump is the same at the next job.
    can_sample_code_ = found.problem.empty();
    if (!found.problem.empty()) report_.not_counted.push_back(std::move(found.problem));
    code_ = std::move(found.mixes);
  }

  struct Runs {
    std::vector<KernelsRun> all;
    std::vector<Pace> limits;                ///< beside each
    std::map<std::string, KernelWork> work;  ///< of the last one that came to its end
  };

  bool is_shown(const std::string& name) const {
    return options_.kernels.empty() || fits_any(name, options_.kernels);
  }

  /// @param spent in every run.
  KernelFigures figures(const std::string& name, const Job& job, const std::vector<Spent>& spent,
                        const Runs& runs) const {
    KernelFigures f;
    f.kernel = name;
    f.iterations = job.iterations;
    f.samples = job.samples;
    f.factors = options_.map ? options_.map->dynamics.factors.size() : options_.factors;
    f.width = device_.lane_width(options_.precision);
    f.precision = options_.precision;
    std::vector<double> wall;
    for (std::size_t i = 0; i < spent.size(); ++i) {
      f.run_seconds.push_back(spent[i].seconds);
      f.run_fma_per_second.push_back(runs.limits[i].per_second);
      if (clock_) {
        f.run_cpu_seconds.push_back(spent[i].cpu_seconds);
        f.run_fma_per_cpu_second.push_back(runs.limits[i].per_cpu_second);
      }
      wall.push_back(runs.all[i].wall);
    }
    f.median_seconds = base::median(f.run_seconds);
    f.min_seconds = std::ranges::min(f.run_seconds);
    f.max_seconds = std::ranges::max(f.run_seconds);
    f.wall_seconds = base::median(std::move(wall));
    return f;
  }

  std::vector<MeasuredRun> measured_runs(const std::vector<Spent>& spent, const Runs& runs) const {
    std::vector<MeasuredRun> all;
    for (std::size_t i = 0; i < spent.size(); ++i) {
      all.push_back({spent[i], roofs_at(roofs_, runs.limits[i], options_.precision)});
    }
    return all;
  }

  /// Adds the limit, and the share of it that the work reached.
  bool is_busy() const {
    const auto waited = waited_.so_far();
    return waited && *waited > kUsualWait;
  }

  void add_share(const KernelWork& work, const std::vector<MeasuredRun>& runs,
                 KernelFigures& f) const {
    const auto mix = code_.find(f.kernel);
    const JudgedShare found =
        judged_runs(work, runs, is_busy(), mix == code_.end() ? nullptr : &mix->second);
    f.limit = found.limit;
    f.share_of_limit = found.share;
    f.share_low = found.low;
    f.share_high = found.high;
    f.share_verdict = found.verdict;
  }

  /// Says what limits one kernel.
  void explain(const KernelWork& work, const MeasuredRun& last, KernelFigures& f) const {
    if (const auto mix = code_.find(f.kernel); mix != code_.end()) f.instructions = mix->second;
    f.limited_by =
        limited_by(work, last.spent, last.roofs, f.limit, f.share_verdict, f.share_of_limit,
                   f.instructions ? &*f.instructions : nullptr, is_busy());
  }

  void add_job(const Job& job, const Runs& runs) {
    std::vector<Spent> spent;
    for (const KernelsRun& run : runs.all) spent.push_back(run.all);
    KernelFigures f = figures(job.name, job, spent, runs);
    const DeviceLimits& limits = report_.limits;
    const double pairs = static_cast<double>(f.samples) * static_cast<double>(f.factors);
    if (job.iterates > 0) {
      f.executed_factor_iterations = pairs * job.iterates;
      f.pairs_per_second = pairs * job.iterates / f.median_seconds;
    }
    if (job.cost.slots > 0) {
      f.slots = pairs * job.cost.slots;
      f.memory_bytes = static_cast<double>(device::real_bytes(f.precision)) * job.cost.reals;
      KernelWork work;
      work.slots = *f.slots;
      work.bytes = *f.memory_bytes;
      work.is_double = f.precision == Precision::dbl;
      add_share(work, measured_runs(spent, runs), f);
    }
    if (device_.info().kind == DeviceKind::gpu) f.predicted_seconds = predicted_seconds(f, limits);
    if (events_ != nullptr) {
      for (const auto& [name, kernel] : events_->kernels()) {
        for (const auto& [event, count] : kernel.events) f.events[event] += count;
      }
    }
    report_.kernels.push_back(std::move(f));
  }

  /// A row for each kernel that no job before has had at this n.
  void add_kernels(const Job& job, const Runs& runs) {
    const auto& work = runs.work;
    const auto counted = events_ != nullptr ? events_->kernels() : decltype(events_->kernels()){};
    for (const auto& [name, last] : runs.all.back().kernels) {
      if (!is_shown(name) || !seen_.insert({name, job.iterations}).second) continue;
      std::vector<Spent> spent;
      for (const KernelsRun& run : runs.all) {
        const auto found = run.kernels.find(name);
        if (found != run.kernels.end()) spent.push_back(found->second.spent);
      }
      if (spent.size() != runs.all.size()) continue;  // it does not run each time
      KernelFigures f = figures(name, job, spent, runs);
      f.is_one_kernel = true;
      f.launches = last.launches;
      const std::vector<MeasuredRun> measured = measured_runs(spent, runs);
      if (const auto found = work.find(name); found != work.end()) {
        f.precision = found->second.is_double ? Precision::dbl : Precision::single;
        f.work_is_at_most = found->second.at_most;
        if (found->second.slots > 0) f.slots = found->second.slots;
        if (found->second.bytes > 0) f.memory_bytes = found->second.bytes;
        add_share(found->second, measured, f);
      }
      explain(work.find(name) != work.end() ? work.at(name) : KernelWork{}, measured.back(), f);
      if (const auto found = counted.find(name); found != counted.end()) {
        f.events = found->second.events;
        f.resources = found->second.resources;
      }
      report_.kernels.push_back(std::move(f));
    }
  }

  Device device_;
  const ProfileOptions& options_;
  ProfileReport& report_;
  const Roofs& roofs_;
  WorkerClockPointer clock_;
  WaitedShare waited_;
  const ProgressMonitor& monitor_;
  const base::Deadline& deadline_;
  WorkCounter* counter_;   ///< null: single kernels are not asked for
  KernelCounter* events_;  ///< null: counters are not asked for
  std::function<Pace()> limit_now_;
  std::map<std::string, InstructionMix> code_;  ///< of the last job's kernels
  bool can_sample_code_ = true;                 ///< as far as is known
  std::set<std::pair<std::string, int>> seen_;
};

/// The limits as roofs; the other precision has none.
Roofs roofs_of(const DeviceLimits& limits, Precision precision) {
  Roofs roofs;
  roofs.bytes_per_second = limits.bytes_per_second;
  roofs.bytes_per_cpu_second = limits.bytes_per_cpu_second;
  const bool is_double = precision == Precision::dbl;
  (is_double ? roofs.double_fma_per_second : roofs.fma_per_second) = limits.fma_per_second;
  (is_double ? roofs.double_fma_per_cpu_second : roofs.fma_per_cpu_second) =
      limits.fma_per_cpu_second;
  return roofs;
}

}  // namespace

std::optional<double> KernelFigures::processors() const {
  if (run_cpu_seconds.empty() || run_cpu_seconds.size() != run_seconds.size()) return std::nullopt;
  std::vector<double> ratios;
  for (std::size_t i = 0; i < run_seconds.size(); ++i) {
    ratios.push_back(run_cpu_seconds[i] / run_seconds[i]);
  }
  return base::median(std::move(ratios));
}

void ProfileOptions::validate() const {
  expect_in_ranges(profile_settings(), *this);
  if (lane_width && *lane_width != 1 && *lane_width != 8 && *lane_width != 16) {
    throw OptionError("lane_width",
                      fmt::format("{} is out of range; give 1, 8 or 16", *lane_width));
  }
  if (map) map->validate();
  if (mesh) mesh->validate();
}

ProfileReport profile(const Device& chosen, const ProfileOptions& options,
                      const ProgressMonitor& monitor) {
  options.validate();
  constexpr double kNoLimit = std::numeric_limits<double>::infinity();
  const base::Deadline deadline(monitor.stop, options.time_limit.value_or(kNoLimit));
  const Device device = options.lane_width ? chosen.with_lane_width(*options.lane_width) : chosen;
  ProfileReport report;
  report.device = device.info();
  report.layout = device.layout();
  report.tuning = device.tuning(options.precision);
  report.is_tuned = device.is_tuned(options.precision);
  monitor.report({"profiling", 0, -1, "limits of the device"});
  const int limit_repeats = options.time_limit ? 1 : options.repeats;
  const WorkerClockPointer clock = worker_clock(device);
  const WaitedShare waited(clock);
  report.limits = measure_limits(device, options.precision, limit_repeats, clock);

  const bool by_kernel = wants_all_jobs(options) || options.counters;
  WorkCounter counter;
  std::optional<device::WatchedLaunches> watched;
  if (by_kernel) watched.emplace(counter);
  const Roofs roofs =
      by_kernel ? measure_roofs(device, clock) : roofs_of(report.limits, options.precision);
  report.caches = roofs.caches;
  const std::vector<Job> jobs = jobs_of(device, options, report.left_out);
  if (jobs.empty() && !options.kernels.empty()) {
    throw OptionError("kernels", "no job or kernel has such a name; '*' shows all names");
  }
  // A device on this host's processor has started its threads by now.
  std::optional<ProcessEvents> events;
  if (options.counters && device.info().kind == DeviceKind::cpu) {
    events.emplace(system_event_calls());
    report.not_counted = events->refused();
  } else if (options.counters) {
    report.not_counted.emplace_back("events: the host's processor counts nothing of a GPU's");
  }
  report.has_counters = options.counters;
  KernelCounter of_kernels(events ? &*events : nullptr);
  Bench bench(device, options, report, roofs, clock, monitor, deadline,
              by_kernel ? &counter : nullptr, options.counters ? &of_kernels : nullptr);
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    monitor.report({"profiling", static_cast<double>(i) / static_cast<double>(jobs.size()), -1,
                    fmt::format("{}, n = {}", jobs[i].name, jobs[i].iterations)});
    bench.time(jobs[i], jobs.size() - i);
  }
  report.fma_per_second_after =
      measure_fma(device, options.precision, limit_repeats, clock).per_second;
  report.waited_share = waited.so_far();
  monitor.report({"profiling", 1, 0, ""});
  return report;
}

}  // namespace qjulia
