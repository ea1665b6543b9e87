#pragma once
/// Finds the settings with which a device runs the kernels of a fit fastest.

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "qjulia/profile.hpp"
#include "qjulia/tuning.hpp"

namespace qjulia {

/// One kernel's job at one size, with a setting and with the best before it, run in turns.
struct TuneTime {
  std::string job;  ///< energy, gradient, orbit_energy, orbit_gradient or gauss_newton
  std::size_t samples = 0;
  double seconds = 0;         ///< the fastest run with the setting
  double before_seconds = 0;  ///< and without
};

/// One setting that was tried in place of the best so far.
struct TuneTrial {
  std::string setting;
  int value = 0;
  /// Largest difference from the results with the device's defaults, relative to the largest of
  /// energy, gradient and Gauss-Newton matrix each.
  double difference = 0;
  /// Time over the best so far's, both timed in turns: geometric mean over the kernels that the
  /// setting changes. 0 where it was not timed.
  double time_ratio = 0;
  std::vector<TuneTime> times;
  bool taken = false;
  std::string refused;  ///< why it was not timed to the end; empty where it was
};

struct TuneReport {
  DeviceInfo device;
  Precision precision = Precision::single;
  double tolerance = 0;   ///< what `difference` must not exceed
  Tuning tuning;          ///< the best
  double time_ratio = 1;  ///< over the defaults' in the end, over all kernels; 1 where these stay
  std::vector<TuneTrial> trials;
  /// Why the defaults stayed, a sentence; empty where they did not.
  std::string why_defaults;
};

/// Tries lane widths, then the other settings one by one. What differs from the results with the
/// default settings by more than 1e-4 (double: 1e-10), at a quarter of the workload's samples, is
/// refused and not timed. Times are of the whole workload and of the quarter; a setting is taken
/// only when it is 3 % faster.
TuneReport tune(const Device& device, const ProfileOptions& options,
                const ProgressMonitor& monitor = {});

nlohmann::json to_json(const TuneReport& report);

/// Settings to measure, each with its values: all combinations.
using TuneGrid = std::map<std::string, std::vector<int>>;

/// One job with one combination of settings.
struct GridTime {
  Tuning tuning;
  std::string job;
  std::size_t samples = 0;
  std::vector<double> seconds;  ///< of each run, on the device; empty where it was refused
  std::string refused;          ///< why it cannot run here
};

struct GridReport {
  DeviceInfo device;
  Precision precision = Precision::single;
  std::vector<GridTime> times;
};

/// Measures every combination, other settings as default: all jobs of a fit, `repeats` runs each.
/// @throws OptionError for a setting that is not known or that has no value, and for more than
/// 1,000 combinations.
GridReport measure_grid(const Device& device, const ProfileOptions& options, const TuneGrid& grid,
                        const ProgressMonitor& monitor = {});

nlohmann::json to_json(const GridReport& report);
/// A line for each job and combination under a line of names.
std::string to_csv(const GridReport& report);

}  // namespace qjulia
