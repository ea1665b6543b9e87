#pragma once
/// What a GPU takes for a job by its compiled code.

#include <optional>

#include "qjulia/profile/profile.hpp"

namespace qjulia::profiling {

/// Seconds that the instructions, as counted for GPUs, and the memory traffic take at these limits.
/// Nothing where they were not counted.
std::optional<double> predicted_seconds(const KernelFigures& figures, const DeviceLimits& limits);

}  // namespace qjulia::profiling
