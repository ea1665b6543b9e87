#include "qjulia/tune.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "device/quirks.hpp"
#include "profile/workload.hpp"
#include "qjulia/error.hpp"
#include "qjulia/progress.hpp"

namespace qjulia {

using namespace profiling;
namespace {

/// Less is noise.
constexpr double kFaster = 0.97;
/// Settings this much slower at the first try are not tried again.
constexpr double kHopeless = 1.3;

constexpr std::array kAllJobs{TuneJob::energy, TuneJob::gradient, TuneJob::orbit_energy,
                              TuneJob::orbit_gradient, TuneJob::gauss_newton};

struct TunedSetting {
  const char* name;
  int Tuning::*value;
  std::vector<TuneJob> jobs;               ///< that it changes
  std::vector<int> factors{-4, -2, 2, 4};  ///< tried times the value; negative: its parts
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

bool is_valid(const Tuning& tuning) {
  try {
    tuning.validate();
  } catch (const InputError&) {
    return false;
  }
  return true;
}

class Tuner {
 public:
  Tuner(const Device& device, const ProfileOptions& options, const ProgressMonitor& monitor)
      : device_(device), options_(options), monitor_(monitor) {
    ProfileOptions quarter = options;
    quarter.samples = std::max<std::size_t>(options.samples / 4, 64);
    works_ = {make_workload(options), make_workload(quarter)};
    report_.device = device.info();
    report_.precision = options.precision;
    report_.tolerance = options.precision == Precision::dbl ? 1e-10 : 1e-4;
    default_ = device::default_tuning(device.info(), options.precision, device.layout());
    TuneBench bench(with(default_), works_.back(), options_.precision);
    for (const TuneJob job : kAllJobs) expected_.push_back(bench.run(job));
  }

  TuneReport run() && {
    const TunedSetting lane_width{
        "lane_width", &Tuning::lane_width, {kAllJobs.begin(), kAllJobs.end()}};
    std::vector<Tuning> widths;
    for (const int width : {1, 8, 16}) {
      if (width == default_.lane_width) continue;
      widths.push_back(
          device::default_tuning(device_.info(), options_.precision, device_.layout(), width));
    }
    Tuning best = fastest(lane_width, widths, default_);
    for (const TunedSetting& setting : settings()) {
      std::vector<Tuning> tried;
      for (const int factor : setting.factors) {
        Tuning tuning = best;
        int& value = tuning.*setting.value;
        value = factor < 0 ? value / -factor : value * factor;
        if (is_valid(tuning)) tried.push_back(tuning);
      }
      best = fastest(setting, tried, best);
    }
    report_.tuning = default_;
    if (best == default_) {
      report_.why_defaults = nothing_faster();
    } else {
      const auto ratio = time_ratio(best, default_, kAllJobs);
      if (ratio && *ratio < 1) {
        report_.tuning = best, report_.time_ratio = *ratio;
      } else if (ratio) {
        report_.why_defaults = fmt::format(
            "all chosen settings together need {:.3f} times the defaults' time", *ratio);
      } else {
        report_.why_defaults = fmt::format(
            "all chosen settings together need over {} times the defaults' time in the "
            "first job; measure again on an idle machine",
            kHopeless);
      }
    }
    return std::move(report_);
  }

 private:
  /// What came nearest to being taken.
  std::string nothing_faster() const {
    const TuneTrial* nearest = nullptr;
    for (const TuneTrial& t : report_.trials) {
      if (t.time_ratio > 0 && (nearest == nullptr || t.time_ratio < nearest->time_ratio)) {
        nearest = &t;
      }
    }
    if (nearest == nullptr) return "no other setting could be timed";
    return fmt::format(
        "the best other setting, {} {}, takes {:.3f} times as long, and {:.2f} is asked for",
        nearest->setting, nearest->value, nearest->time_ratio, kFaster);
  }

  Device with(const Tuning& tuning) const {
    return device_.with_tuning(options_.precision, tuning);
  }

  /// Tries each of `tunings`, which differ from `before` in a setting, against it.
  /// @return the fastest of all.
  Tuning fastest(const TunedSetting& setting, const std::vector<Tuning>& tunings,
                 const Tuning& before) {
    Tuning best = before;
    double least = kFaster;
    std::optional<std::size_t> taken;
    for (const Tuning& tuning : tunings) {
      const int value = tuning.*setting.value;
      monitor_.report({"tuning", -1, -1, fmt::format("{} {}", setting.name, value)});
      TuneTrial trial{setting.name, value, 0, 0, {}, false, {}};
      try {
        trial.difference = difference(tuning, setting.jobs);
        if (!(trial.difference <= report_.tolerance)) {
          trial.refused = "its results differ";
        } else if (const auto ratio = time_ratio(tuning, before, setting.jobs, &trial.times)) {
          trial.time_ratio = *ratio;
          if (*ratio < least) least = *ratio, best = tuning, taken = report_.trials.size();
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

  /// Geometric mean over jobs and sizes, each by the fastest of its runs; none when hopeless.
  std::optional<double> time_ratio(const Tuning& tuning, const Tuning& before,
                                   std::span<const TuneJob> jobs,
                                   std::vector<TuneTime>* times = nullptr) const {
    double sum = 0;
    int count = 0;
    for (const Workload& work : works_) {
      TuneBench tried(with(tuning), work, options_.precision);
      TuneBench standing(with(before), work, options_.precision);
      for (const TuneJob job : jobs) {
        tried.run(job), standing.run(job);  // fills the caches
        double tried_least = std::numeric_limits<double>::infinity(), standing_least = tried_least;
        for (int i = 0; i < options_.repeats; ++i) {
          throw_if_stopped(monitor_.stop);
          standing_least = std::min(standing_least, standing.time(job));
          tried_least = std::min(tried_least, tried.time(job));
          // One run alone may be slow because of other work.
          if (i > 0 && tried_least > kHopeless * standing_least) break;
        }
        if (times != nullptr) {
          times->push_back({to_string(job), work.samples.size(), tried_least, standing_least});
        }
        sum += std::log(tried_least / standing_least);
        ++count;
        if (count == 1 && sum > std::log(kHopeless)) return std::nullopt;
      }
    }
    return std::exp(sum / count);
  }

  Device device_;
  const ProfileOptions& options_;
  const ProgressMonitor& monitor_;
  std::vector<Workload> works_;
  Tuning default_;
  std::vector<std::vector<double>> expected_;  ///< by job, of the smaller workload
  TuneReport report_;
};

}  // namespace

TuneReport tune(const Device& device, const ProfileOptions& options,
                const ProgressMonitor& monitor) {
  options.validate();
  return Tuner(device, options, monitor).run();
}

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
         {"time_ratio", t.time_ratio > 0 ? nlohmann::json(t.time_ratio) : nullptr},
         {"times", times},
         {"taken", t.taken},
         {"refused", t.refused.empty() ? nlohmann::json(nullptr) : nlohmann::json(t.refused)}});
  }
  return {{"device", report.device.name},
          {"precision", to_string(report.precision)},
          {"tolerance", report.tolerance},
          {"tuning", to_json(report.tuning)},
          {"time_ratio", report.time_ratio},
          {"trials", trials},
          {"why_defaults", report.why_defaults.empty() ? nlohmann::json(nullptr)
                                                       : nlohmann::json(report.why_defaults)}};
}

}  // namespace qjulia
