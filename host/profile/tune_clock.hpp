#pragma once
/// The clock that a tuner uses; tests replace it.

#include <functional>
#include <string>
#include <vector>

#include "profile/workload.hpp"
#include "qjulia/profile/tune.hpp"

namespace qjulia::profiling {

struct TuneClock {
  /// Seconds of one run of the job.
  std::function<double(TuneBench& bench, TuneJob job)> seconds;
  /// Signs of other work since the tuner began.
  std::function<std::vector<std::string>()> disturbances;
};

TuneReport tune_by(const TuneClock& clock, const Device& device, const ProfileOptions& options,
                   const ProgressMonitor& monitor);

}  // namespace qjulia::profiling
