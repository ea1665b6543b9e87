#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "base/median.hpp"
#include "device/quirks.hpp"
#include "profile/interval.hpp"
#include "profile/workload.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/base/progress.hpp"
#include "qjulia/profile/tune.hpp"

namespace qjulia {

using namespace profiling;
namespace {

constexpr std::array kGridJobs{TuneJob::energy, TuneJob::gradient, TuneJob::orbit_energy,
                               TuneJob::orbit_gradient, TuneJob::gauss_newton};

/// One value for each setting of a grid.
using Combination = std::map<std::string, int>;

std::vector<Combination> combinations(const TuneGrid& grid) {
  constexpr std::size_t kMost = 1000;
  std::vector<Combination> all{{}};
  for (const auto& [setting, values] : grid) {
    if (!to_json(Tuning{}).contains(setting)) {
      throw OptionError("grid", fmt::format("'{}' is not a setting of a device", setting));
    }
    if (values.empty()) throw OptionError("grid", fmt::format("{} has no value", setting));
    std::vector<Combination> longer;
    for (const Combination& before : all) {
      for (const int value : values) {
        longer.push_back(before);
        longer.back()[setting] = value;
      }
    }
    if (longer.size() > kMost) {
      throw OptionError("grid", fmt::format("has more than {} combinations; give fewer", kMost));
    }
    all = std::move(longer);
  }
  return all;
}

/// The defaults, for the combination's lane width if it has one, with its other settings.
Tuning tuned(const Device& device, Precision precision, const Combination& combination) {
  const auto width = combination.find("lane_width");
  nlohmann::json json = to_json(device::default_tuning(
      device.info(), precision, device.layout(), width == combination.end() ? 0 : width->second));
  for (const auto& [setting, value] : combination) json[setting] = value;
  return tuning_from(json);
}

}  // namespace

GridReport measure_grid(const Device& device, const ProfileOptions& options, const TuneGrid& grid,
                        const ProgressMonitor& monitor) {
  options.validate();
  const std::vector<Combination> all = combinations(grid);
  GridReport report;
  report.device = device.info();
  report.precision = options.precision;
  const Workload work = make_workload(options);
  for (std::size_t i = 0; i < all.size(); ++i) {
    throw_if_stopped(monitor.stop);
    monitor.report({"measuring", static_cast<double>(i) / static_cast<double>(all.size()), -1,
                    nlohmann::json(all[i]).dump()});
    GridTime refused{all[i], device.tuning(options.precision), "", work.samples.size(), {}, ""};
    try {
      const Tuning tuning = tuned(device, options.precision, all[i]);
      refused.tuning = tuning;
      TuneBench bench(device.with_tuning(options.precision, tuning), work, options.precision);
      for (const TuneJob job : kGridJobs) {
        bench.run(job);  // builds the kernels, fills the caches
        GridTime time{all[i], tuning, to_string(job), work.samples.size(), {}, ""};
        for (int run = 0; run < options.repeats; ++run) {
          throw_if_stopped(monitor.stop);
          time.seconds.push_back(bench.time(job));
        }
        report.times.push_back(std::move(time));
      }
    } catch (const Interrupted&) {
      throw;
    } catch (const Error& error) {
      refused.refused = fmt::format("{}: {}", nlohmann::json(all[i]).dump(), error.what());
      report.times.push_back(refused);
    }
  }
  return report;
}

nlohmann::json to_json(const GridReport& report) {
  nlohmann::json times = nlohmann::json::array();
  for (const GridTime& t : report.times) {
    times.push_back(
        {{"asked", t.asked},
         {"tuning", to_json(t.tuning)},
         {"job", t.job},
         {"samples", t.samples},
         {"seconds", t.seconds},
         {"refused", t.refused.empty() ? nlohmann::json(nullptr) : nlohmann::json(t.refused)}});
  }
  return {
      {"device", report.device.name}, {"precision", to_string(report.precision)}, {"times", times}};
}

std::string to_csv(const GridReport& report) {
  std::string text;
  const nlohmann::json names = to_json(Tuning{});
  for (const auto& [setting, value] : names.items()) text += setting + ',';
  text += "job,samples,runs,median_seconds,min_seconds,max_seconds,spread,refused\n";
  for (const GridTime& t : report.times) {
    const nlohmann::json tuning = to_json(t.tuning);
    for (const auto& [setting, value] : tuning.items()) text += value.dump() + ',';
    if (t.seconds.empty()) {
      std::string words = t.refused;
      std::ranges::replace(words, '"', '\'');
      std::ranges::replace(words, '\n', ' ');
      text += fmt::format("{},{},0,,,,,\"{}\"\n", t.job, t.samples, words);
      continue;
    }
    const double middle = base::median(t.seconds), low = std::ranges::min(t.seconds),
                 high = std::ranges::max(t.seconds);
    text += fmt::format("{},{},{},{:.6g},{:.6g},{:.6g},{:.4f},\n", t.job, t.samples,
                        t.seconds.size(), middle, low, high, (high - low) / middle);
  }
  return text;
}

}  // namespace qjulia
