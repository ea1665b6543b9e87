#pragma once
/// What a device can do at most, by kernels that do nothing else.

#include <functional>
#include <memory>
#include <stop_token>

#include "profile/command_profile.hpp"
#include "profile/worker_clock.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/profile/profile.hpp"

namespace qjulia::profiling {

/// The lanes with which a device's multiply-adds are measured: a CPU's limit is the vectors that it
/// has, whatever width or layout its kernels are compiled for.
int widest_lanes(const Device& device, Precision precision);

/// How much a device does in a second.
struct Pace {
  double per_second = 0;      ///< by the device's clock
  double per_cpu_second = 0;  ///< of its threads; 0 where they are not known
};

using WorkerClockPointer = std::shared_ptr<const WorkerClock>;

/// The clock of the device's threads that run multiply-adds; null where there is none.
WorkerClockPointer worker_clock(const Device& device);

/// Fused multiply-adds, by one run of a kernel that does nothing else.
std::function<Pace()> fma_probe(const Device& device, Precision precision,
                                const WorkerClockPointer& clock);

/// The pace of the best of `repeats` runs, after one that is not counted: a limit is what was
/// reached at least once. @throws Interrupted
Pace measure_fma(const Device& device, Precision precision, int repeats,
                 const WorkerClockPointer& clock, const std::stop_token& stop = {});

/// Bytes that a copy much larger than any cache reads and writes; of the best of `repeats` runs,
/// after one that is not counted.
Pace measure_copy(const Device& device, Precision precision, int repeats,
                  const WorkerClockPointer& clock);

/// Bytes that kernels read from each of a CPU's caches; of the best of `repeats` runs.
std::vector<CacheRoof> measure_caches(const Device& device, int repeats,
                                      const WorkerClockPointer& clock);

/// All limits, each of the best of so many runs.
DeviceLimits measure_limits(const Device& device, Precision precision, int repeats,
                            const WorkerClockPointer& clock);
Roofs measure_roofs(const Device& device, const WorkerClockPointer& clock);

/// The limits, with the multiply-adds of a precision as they were measured at another time.
Roofs roofs_at(const Roofs& roofs, const Pace& pace, Precision precision);

}  // namespace qjulia::profiling
