#pragma once
/// A device's limits, measured by kernels/limits.cl.

#include "qjulia/profile.hpp"

namespace qjulia::profiling {

/// Fused multiply-adds a second, of the best of `repeats` runs: a limit is what was reached at
/// least once.
double measure_fma(const Device& device, Precision precision, int repeats);

/// All limits, each of the best of so many runs.
DeviceLimits measure_limits(const Device& device, Precision precision, int repeats);

}  // namespace qjulia::profiling
