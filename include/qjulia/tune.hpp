#pragma once
/// Finds the settings with which a device runs the kernels of a fit fastest.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "qjulia/profile.hpp"
#include "qjulia/tuning.hpp"

namespace qjulia {

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
};

/// Tries lane widths, then the other settings one by one. What differs from the results with the
/// default settings by more than 1e-4 (double: 1e-10), at a quarter of the workload's samples, is
/// refused and not timed. Times are of the whole workload and of the quarter; a setting is taken
/// only when it is 3 % faster.
TuneReport tune(const Device& device, const ProfileOptions& options,
                const ProgressMonitor& monitor = {});

nlohmann::json to_json(const TuneReport& report);

}  // namespace qjulia
