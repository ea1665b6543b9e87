#pragma once
/// What a device can do at most, by kernels that do nothing else.

#include <functional>

#include "qjulia/device.hpp"
#include "qjulia/profile.hpp"

namespace qjulia::profiling {

/// The lanes with which a device's multiply-adds are measured: a CPU's limit is the vectors that it
/// has, whatever width or layout its kernels are compiled for.
int widest_lanes(const Device& device, Precision precision);

/// Fused multiply-adds a second, by one run of a kernel that does nothing else.
std::function<double()> fma_probe(const Device& device, Precision precision);

/// Of the best of `repeats` runs, after one that is not counted: a limit is what was reached at
/// least once.
double measure_fma(const Device& device, Precision precision, int repeats);

/// Bytes that a copy much larger than any cache reads and writes in a second; of the best of
/// `repeats` runs, after one that is not counted.
double measure_copy(const Device& device, Precision precision, int repeats);

/// All limits, each of the best of so many runs.
DeviceLimits measure_limits(const Device& device, Precision precision, int repeats);

}  // namespace qjulia::profiling
