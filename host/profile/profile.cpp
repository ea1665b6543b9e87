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
#include "profile/processor_watch.hpp"
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
        monitor_(monitor),
        deadline_(deadline),
        counter_(counter),
        events_(events),
        limit_now_(fma_probe(device, options.precision, clock)) {}

  /// @param jobs_left with this one; they share the time that is left.
  void time(const Job& job, std::size_t jobs_left) {
    if (are_all_seen(job)) return;
    Runs runs;
    const ProcessorWatch processors;
    const double left = deadline_.left();
    try {
      throw_if_stopped(deadline_.token());
      job.run(deadline_.token());  // builds the kernels, fills the caches
      const auto start = SteadyClock::now();
      while (runs.want_more(static_cast<std::size_t>(options_.repeats))) {
        throw_if_stopped(deadline_.token());
        const double spent = std::chrono::duration<double>(SteadyClock::now() - start).count();
        if (!runs.all.empty() && spent > left / static_cast<double>(jobs_left)) break;
        if (counter_ != nullptr) counter_->reset();
        const WaitedShare waited(clock_);
        runs.all.push_back(timed_by_kernel(device_, clock_, [&] { job.run(deadline_.token()); }));
        runs.are_quiet.push_back(!(waited.so_far().value_or(0) > kUsualWait));
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
    runs.use = processors.so_far();
    runs.keep_quiet(static_cast<std::size_t>(options_.repeats));
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
    std::vector<bool> are_quiet;             ///< whether other programs left it the processors
    std::map<std::string, KernelWork> work;  ///< of the last one that came to its end
    std::optional<ProcessorUse> use;
    std::size_t left_out = 0;

    std::size_t quiet() const {
      return static_cast<std::size_t>(std::ranges::count(are_quiet, true));
    }
    /// Where other programs come and go, their runs are made again, up to so many times in all.
    bool want_more(std::size_t repeats) const {
      constexpr std::size_t kMost = 3;
      if (all.size() < repeats) return true;
      return quiet() < repeats && kMost * quiet() >= all.size() && all.size() < kMost * repeats;
    }
    bool are_busy(std::size_t repeats) const {
      return quiet() < std::min(repeats, static_cast<std::size_t>(kLeastRuns)) &&
             quiet() < all.size();
    }
    /// Leaves the other runs out, if there are enough.
    void keep_quiet(std::size_t repeats) {
      if (are_busy(repeats)) return;
      left_out = all.size() - quiet();
      for (std::size_t i = all.size(); i-- > 0;) {
        if (are_quiet[i]) continue;
        const auto at = static_cast<std::ptrdiff_t>(i);
        all.erase(all.begin() + at);
        limits.erase(limits.begin() + at);
        are_quiet.erase(are_quiet.begin() + at);
      }
    }
  };

  bool are_busy(const Runs& runs) const {
    return runs.are_busy(static_cast<std::size_t>(options_.repeats));
  }

  /// Whether all that the job could show is shown.
  bool are_all_seen(const Job& job) const {
    if (options_.kernels.empty() || is_shown(job.name)) return false;
    return std::ranges::all_of(job.kernels, [&](const std::string& kernel) {
      return !is_shown(kernel) || seen_.contains({kernel, job.iterations});
    });
  }

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
    f.runs_left_out = runs.left_out;
    return f;
  }

  std::vector<MeasuredRun> measured_runs(const std::vector<Spent>& spent, const Runs& runs) const {
    std::vector<MeasuredRun> all;
    for (std::size_t i = 0; i < spent.size(); ++i) {
      all.push_back({spent[i], roofs_at(roofs_, runs.limits[i], options_.precision)});
    }
    return all;
  }

  /// Null where it is not known.
  const InstructionMix* mix_of(const std::string& kernel) const {
    const auto mix = code_.find(kernel);
    return mix == code_.end() ? nullptr : &mix->second;
  }

  static void add_share(const JudgedShare& found, KernelFigures& f) {
    f.limit = found.limit;
    f.share_of_limit = found.share;
    f.share_low = found.low;
    f.share_high = found.high;
    f.share_verdict = found.verdict;
  }

  /// The kernel that takes most of a job's time; empty where none does.
  static std::string main_kernel(const Runs& runs) {
    constexpr double kMost = 0.8;
    const KernelsRun& last = runs.all.back();
    for (const auto& [name, kernel] : last.kernels) {
      if (kernel.spent.seconds > kMost * last.all.seconds) return name;
    }
    return {};
  }

  /// Of a job. It is not judged where the kernel that takes most of its time is not.
  JudgedShare judged_job(const KernelWork& work, const std::vector<Spent>& spent,
                         const Runs& runs) const {
    const std::string kernel = main_kernel(runs);
    const InstructionMix* const mix = mix_of(kernel);
    JudgedShare found = judged_runs(work, measured_runs(spent, runs), are_busy(runs), mix);
    const auto of_kernel = runs.work.find(kernel);
    if (!found.share || of_kernel == runs.work.end()) return found;
    const std::vector<Spent> of_runs = spent_by(kernel, runs);
    if (of_runs.size() < runs.all.size()) return found;
    const JudgedShare same =
        judged_runs(of_kernel->second, measured_runs(of_runs, runs), are_busy(runs), mix);
    if (same.doubt != Doubt::none) found.share.reset(), found.verdict = same.verdict;
    return found;
  }

  /// What a kernel took in each run; fewer than runs if it does not run each time.
  static std::vector<Spent> spent_by(const std::string& kernel, const Runs& runs) {
    std::vector<Spent> spent;
    for (const KernelsRun& run : runs.all) {
      const auto found = run.kernels.find(kernel);
      if (found != run.kernels.end()) spent.push_back(found->second.spent);
    }
    return spent;
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
      add_share(judged_job(work, spent, runs), f);
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
      const std::vector<Spent> spent = spent_by(name, runs);
      if (spent.size() != runs.all.size()) continue;  // it does not run each time
      KernelFigures f = figures(name, job, spent, runs);
      f.is_one_kernel = true;
      f.launches = last.launches;
      const auto of_kernel = work.find(name);
      const KernelWork all = of_kernel != work.end() ? of_kernel->second : KernelWork{};
      if (of_kernel != work.end()) {
        f.precision = all.is_double ? Precision::dbl : Precision::single;
        f.work_is_at_most = all.at_most;
        f.sizes = all.sizes;
        if (all.slots > 0) f.slots = all.slots;
        if (all.bytes > 0) f.memory_bytes = all.bytes;
      }
      const InstructionMix* const mix = mix_of(name);
      if (mix != nullptr) f.instructions = *mix;
      const std::vector<MeasuredRun> measured = measured_runs(spent, runs);
      const JudgedShare judged = judged_runs(all, measured, are_busy(runs), mix);
      add_share(judged, f);
      f.limited_by = limited_by(all, measured.back().spent, judged,
                                {measured.back().roofs, mix, measured.size(), runs.use});
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
  const std::vector<Job> jobs = jobs_of(device, options, report.left_out);
  if (jobs.empty() && !options.jobs.empty()) {
    throw OptionError("jobs", "no job has such a name and such kernels; '*' shows all names");
  }
  if (jobs.empty() && !options.kernels.empty()) {
    throw OptionError("kernels", "no job or kernel has such a name; '*' shows all names");
  }
  monitor.report({"profiling", 0, -1, "limits of the device"});
  const int limit_repeats = options.time_limit ? 1 : options.repeats;
  const WorkerClockPointer clock = worker_clock(device);
  const WaitedShare waited(clock);
  const ProcessorWatch processors;
  report.limits = measure_limits(device, options.precision, limit_repeats, clock);

  const bool by_kernel = wants_all_jobs(options) || options.counters;
  WorkCounter counter;
  std::optional<device::WatchedLaunches> watched;
  if (by_kernel) watched.emplace(counter);
  const Roofs roofs =
      by_kernel ? measure_roofs(device, clock) : roofs_of(report.limits, options.precision);
  report.caches = roofs.caches;
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
  report.use = processors.so_far();
  monitor.report({"profiling", 1, 0, ""});
  return report;
}

}  // namespace qjulia
