#pragma once
/// Finds the settings with which a device runs the kernels of a fit fastest.

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "qjulia/device/tuning.hpp"
#include "qjulia/profile/profile.hpp"

namespace qjulia {

/// One kernel's job at one size, with a setting and with the best before it, run in turns.
struct TuneTime {
  std::string job;  ///< energy, gradient, orbit_energy, orbit_gradient or gauss_newton
  std::size_t samples = 0;
  double seconds = 0;         ///< the fastest run with the setting
  double before_seconds = 0;  ///< and without
};

/// A ratio of times with its 90 % confidence interval: the median of such ratios lies between `low`
/// and `high`.
struct TimeRatio {
  double low = 0;
  double middle = 0;
  double high = 0;
};

/// One setting that was tried in place of the best so far.
struct TuneTrial {
  std::string setting;
  int value = 0;
  /// Largest difference from the results with the device's defaults, relative to the largest of
  /// energy, gradient and Gauss-Newton matrix each.
  double difference = 0;
  /// Time with this setting over time with the best settings so far, the two timed in turns. In
  /// each turn it is the geometric mean over the sizes and over the kernels that the setting
  /// changes. Empty where it was not timed to the end.
  std::optional<TimeRatio> time_ratio;
  std::vector<TuneTime> times;
  bool taken = false;
  std::string refused;  ///< why it was not timed to the end; empty where it was
};

struct TuneReport {
  DeviceInfo device;
  Precision precision = Precision::single;
  double tolerance = 0;  ///< what `difference` must not exceed
  Tuning before;         ///< the device's settings
  Tuning tuning;         ///< the best; `before` where these stay
  /// Time with the chosen settings over time with `before`, over all kernels, measured once more at
  /// the end; empty where nothing was chosen.
  std::optional<TimeRatio> time_ratio;
  std::vector<TuneTrial> trials;
  /// A sentence that says why the settings stayed; empty where they changed.
  std::string why_kept;
  /// Signs that other work disturbed the measurement, a sentence each. Where there are any, the
  /// settings stay.
  std::vector<std::string> disturbances;
};

/// Tries lane widths, then the other settings one by one, in place of the device's. A setting whose
/// results at a quarter of the workload's samples differ from those of the default settings by more
/// than 1e-4 (double: 1e-10) is refused and not timed. Times are taken for the whole workload and
/// for the quarter. A setting is taken only when it is certainly 3 % faster: the upper end of its
/// ratio's interval is at most .97, which asks for five repeats. All that were taken are then timed
/// together and judged in the same way.
TuneReport tune(const Device& device, const ProfileOptions& options,
                const ProgressMonitor& monitor = {});

nlohmann::json to_json(const TuneReport& report);

/// Settings to measure, each with its values: all combinations.
using TuneGrid = std::map<std::string, std::vector<int>>;

/// One job with one combination of settings.
struct GridTime {
  std::map<std::string, int> asked;  ///< the combination
  Tuning tuning;                     ///< with it; the default where it was refused
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
