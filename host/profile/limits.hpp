#pragma once
/// A device's limits, measured by kernels/limits.cl.

#include "qjulia/profile.hpp"

namespace qjulia::profiling {

/// The best of `repeats` runs: a limit is what was reached at least once.
DeviceLimits measure_limits(const Device& device, Precision precision, int repeats);

}  // namespace qjulia::profiling
