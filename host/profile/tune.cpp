#include "qjulia/profile/tune.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "device/quirks.hpp"
#include "profile/interval.hpp"
#include "profile/limits.hpp"
#include "profile/processor_watch.hpp"
#include "profile/roof.hpp"
#include "profile/tune_clock.hpp"
#include "profile/worker_clock.hpp"
#include "profile/workload.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/base/progress.hpp"

namespace qjulia {

using namespace profiling;
namespace {

/// The limit of the upper end of a ratio's interval.
constexpr double kFaster = 0.97;
/// Settings this much slower at the first try are not tried again.
constexpr double kHopeless = 1.3;

constexpr std::array kAllJobs{TuneJob::energy, TuneJob::gradient, TuneJob::orbit_energy,
                              TuneJob::orbit_gradient, TuneJob::gauss_newton};

struct TunedSetting {
  const char* name;
  int Tuning::*value;
  std::vector<TuneJob> jobs;               ///< that it changes
  std::vector<int> factors{-4, -2, 2, 4};  ///< the value is tried times each; −n: divided by n
};

const std::vector<TunedSetting>& settings() {
  using enum TuneJob;
  static const std::vector<TunedSetting> all{
      {"energy_vectors", &Tuning::energy_vectors, {energy, orbit_energy}},
      {"gradient_rows", &Tuning::gradient_rows, {gradient}},
      {"orbit_items", &Tuning::orbit_items, {orbit_gradient}},
      {"orbit_group", &Tuning::orbit_group, {orbit_gradient}},
      {"panel_samples", &Tuning::panel_samples, {gauss_newton}},
      {"panel_block", &Tuning::panel_block, {gauss_newton}},
      {"product_side", &Tuning::product_side, {gauss_newton}, {-16, 16}}};
  return all;
}

bool is_valid(const Tuning& tuning, const DeviceInfo& info) {
  if (device::has_barriers(tuning) && device::may_miscompile_barriers(info)) return false;
  try {
    tuning.validate();
  } catch (const InputError&) {
    return false;
  }
  return true;
}

class Tuner {
 public:
  Tuner(const TuneClock& clock, const Device& device, const ProfileOptions& options,
        const ProgressMonitor& monitor)
      : clock_(clock), device_(device), options_(options), monitor_(monitor) {
    ProfileOptions quarter = options;
    quarter.sample_points = std::max<std::uint64_t>(options.sample_points / 4, 64);
    works_ = {make_workload(options), make_workload(quarter)};
    report_.device = device.info();
    report_.precision = options.precision;
    report_.tolerance = options.precision == Precision::dbl ? 1e-10 : 1e-4;
    report_.before = report_.tuning = device.tuning(options.precision);
    TuneBench bench(with(device::default_tuning(device.info(), options.precision, device.layout())),
                    works_.back(), options_.precision);
    for (const TuneJob job : kAllJobs) expected_.push_back(bench.run(job));
  }

  TuneReport run() && {
    const TunedSetting lane_width{
        "lane_width", &Tuning::lane_width, {kAllJobs.begin(), kAllJobs.end()}};
    std::vector<Tuning> widths;
    for (const int width : {1, 8, 16}) {
      const Tuning tuning =
          device::default_tuning(device_.info(), options_.precision, device_.layout(), width);
      if (tuning != report_.before) widths.push_back(tuning);
    }
    Tuning best = fastest(lane_width, widths, report_.before);
    for (const TunedSetting& setting : settings()) {
      std::vector<Tuning> tried;
      for (const int factor : setting.factors) {
        Tuning tuning = best;
        int& value = tuning.*setting.value;
        value = factor < 0 ? value / -factor : value * factor;
        if (is_valid(tuning, report_.device)) tried.push_back(tuning);
      }
      best = fastest(setting, tried, best);
    }
    if (best != report_.before) report_.time_ratio = time_ratio(best, report_.before, kAllJobs);
    report_.disturbances = clock_.disturbances();
    report_.why_kept = why_kept(best);
    if (report_.why_kept.empty()) report_.tuning = best;
    return std::move(report_);
  }

 private:
  /// Says why the settings stay; empty where the chosen ones replace them.
  std::string why_kept(const Tuning& chosen) const {
    if (!report_.disturbances.empty())
      return "the machine was busy, and times measured then are not used";
    if (options_.repeats < kLeastRuns) {
      return fmt::format("{} of each setting are too few to be certain; give {} repeats or more",
                         options_.repeats == 1 ? "1 run" : fmt::format("{} runs", options_.repeats),
                         kLeastRuns);
    }
    if (chosen == report_.before) return nothing_faster();
    if (!report_.time_ratio) {
      return fmt::format("all chosen settings together need over {} times as long in the first job",
                         kHopeless);
    }
    if (is_faster(report_.time_ratio)) return {};
    return fmt::format(
        "all chosen settings together take {:.3f} times as long, between {:.3f} and {:.3f}, and "
        "{:.2f} at most is asked for",
        report_.time_ratio->middle, report_.time_ratio->low, report_.time_ratio->high, kFaster);
  }

  /// What came nearest to being taken.
  std::string nothing_faster() const {
    const TuneTrial* nearest = nullptr;
    for (const TuneTrial& t : report_.trials) {
      if (t.time_ratio && (nearest == nullptr || t.time_ratio->high < nearest->time_ratio->high)) {
        nearest = &t;
      }
    }
    if (nearest == nullptr) return "no other setting could be timed";
    return fmt::format(
        "the best other setting, {} {}, takes {:.3f} times as long, between {:.3f} and {:.3f}, and "
        "{:.2f} at most is asked for",
        nearest->setting, nearest->value, nearest->time_ratio->middle, nearest->time_ratio->low,
        nearest->time_ratio->high, kFaster);
  }

  bool is_faster(const std::optional<TimeRatio>& ratio) const {
    return options_.repeats >= kLeastRuns && ratio && ratio->high <= kFaster;
  }

  Device with(const Tuning& tuning) const {
    return device_.with_tuning(options_.precision, tuning);
  }

  /// Tries each of `tunings`, which differ from `before` in a setting, against it.
  /// @return the fastest of all.
  Tuning fastest(const TunedSetting& setting, const std::vector<Tuning>& tunings,
                 const Tuning& before) {
    Tuning best = before;
    double least = 1;
    std::optional<std::size_t> taken;
    for (const Tuning& tuning : tunings) {
      const int value = tuning.*setting.value;
      monitor_.report({"tuning", -1, -1, fmt::format("{} {}", setting.name, value)});
      TuneTrial trial{setting.name, value, 0, {}, {}, false, {}};
      try {
        trial.difference = difference(tuning, setting.jobs);
        if (!(trial.difference <= report_.tolerance)) {
          trial.refused = "its results differ";
        } else if (const auto ratio = time_ratio(tuning, before, setting.jobs, &trial.times)) {
          trial.time_ratio = ratio;
          if (is_faster(ratio) && ratio->middle < least) {
            least = ratio->middle, best = tuning, taken = report_.trials.size();
          }
        } else {
          trial.refused = "much slower";
        }
      } catch (const Interrupted&) {
        throw;
      } catch (const Error& error) {
        trial.refused = error.what();  // this device cannot do it
      }
      report_.trials.push_back(std::move(trial));
    }
    if (taken) report_.trials[*taken].taken = true;
    return best;
  }

  double difference(const Tuning& tuning, std::span<const TuneJob> jobs) const {
    double largest = 0;
    TuneBench bench(with(tuning), works_.back(), options_.precision);
    for (const TuneJob job : jobs) {
      const auto& expected = expected_[static_cast<std::size_t>(job)];
      largest = std::max(largest, largest_difference(bench.run(job), expected));
    }
    return largest;
  }

  /// In each turn, the ratio of both settings' times, as geometric means over jobs and sizes; empty
  /// where it is hopeless.
  std::optional<TimeRatio> time_ratio(const Tuning& tuning, const Tuning& before,
                                      std::span<const TuneJob> jobs,
                                      std::vector<TuneTime>* times = nullptr) const {
    std::vector<double> logs(static_cast<std::size_t>(options_.repeats), 0);  // sums, by turn
    int count = 0;
    for (const Workload& work : works_) {
      TuneBench tried(with(tuning), work, options_.precision);
      TuneBench standing(with(before), work, options_.precision);
      for (const TuneJob job : jobs) {
        tried.run(job), standing.run(job);  // fills the caches
        double tried_least = std::numeric_limits<double>::infinity(), standing_least = tried_least;
        for (std::size_t turn = 0; turn < logs.size(); ++turn) {
          throw_if_stopped(monitor_.stop);
          const double without = clock_.seconds(standing, job), with = clock_.seconds(tried, job);
          standing_least = std::min(standing_least, without);
          tried_least = std::min(tried_least, with);
          logs[turn] += std::log(with / without);
          // One run alone may be slow because of other work.
          if (count == 0 && turn > 0 && tried_least > kHopeless * standing_least) break;
        }
        if (times != nullptr) {
          times->push_back({to_string(job), work.samples.size(), tried_least, standing_least});
        }
        if (++count == 1 && tried_least > kHopeless * standing_least) return std::nullopt;
      }
    }
    std::vector<double> ratios;
    ratios.reserve(logs.size());
    for (const double sum : logs) ratios.push_back(std::exp(sum / count));
    const Interval interval = interval_of_median(std::move(ratios));
    return TimeRatio{interval.low, interval.middle, interval.high};
  }

  const TuneClock& clock_;
  Device device_;
  const ProfileOptions& options_;
  const ProgressMonitor& monitor_;
  std::vector<Workload> works_;
  std::vector<std::vector<double>> expected_;  ///< by job, of the smaller workload
  TuneReport report_;
};

}  // namespace

TuneReport profiling::tune_by(const TuneClock& clock, const Device& device,
                              const ProfileOptions& options, const ProgressMonitor& monitor) {
  options.validate();
  return Tuner(clock, device, options, monitor).run();
}

TuneReport tune(const Device& device, const ProfileOptions& options,
                const ProgressMonitor& monitor) {
  options.validate();
  constexpr int kRuns = 3;
  const WorkerClockPointer workers = worker_clock(device);
  const WaitedShare waited(workers);
  const ProcessorWatch processors;
  const auto limit = [&] {
    return measure_fma(device, options.precision, kRuns, workers).per_second;
  };
  const double before = limit();
  TuneClock clock;
  clock.seconds = [](TuneBench& bench, TuneJob job) { return bench.time(job); };
  clock.disturbances = [&] {
    return signs_of_load(before, limit(), waited.so_far(), processors.so_far());
  };
  return tune_by(clock, device, options, monitor);
}

namespace {

nlohmann::json to_json(const std::optional<TimeRatio>& ratio) {
  if (!ratio) return nullptr;
  return {{"low", ratio->low}, {"middle", ratio->middle}, {"high", ratio->high}};
}

}  // namespace

nlohmann::json to_json(const TuneReport& report) {
  nlohmann::json trials = nlohmann::json::array();
  for (const TuneTrial& t : report.trials) {
    nlohmann::json times = nlohmann::json::array();
    for (const TuneTime& time : t.times) {
      times.push_back({{"job", time.job},
                       {"samples", time.samples},
                       {"seconds", time.seconds},
                       {"before_seconds", time.before_seconds}});
    }
    trials.push_back(
        {{"setting", t.setting},
         {"value", t.value},
         {"difference", std::isfinite(t.difference) ? nlohmann::json(t.difference) : nullptr},
         {"time_ratio", to_json(t.time_ratio)},
         {"times", times},
         {"taken", t.taken},
         {"refused", t.refused.empty() ? nlohmann::json(nullptr) : nlohmann::json(t.refused)}});
  }
  return {{"device", report.device.name},
          {"precision", to_string(report.precision)},
          {"tolerance", report.tolerance},
          {"tuning", to_json(report.tuning)},
          {"before", to_json(report.before)},
          {"time_ratio", to_json(report.time_ratio)},
          {"trials", trials},
          {"disturbances", report.disturbances},
          {"why_kept",
           report.why_kept.empty() ? nlohmann::json(nullptr) : nlohmann::json(report.why_kept)}};
}

}  // namespace qjulia
