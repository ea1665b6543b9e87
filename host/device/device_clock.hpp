#pragma once
/// Places a device's times on the host's clock.

#include <algorithm>
#include <chrono>

#include "qjulia/base/trace.hpp"

namespace qjulia::device {

/// When a command was queued, began and ended by the device's clock, whose zero is its own.
struct DeviceTimes {
  std::chrono::nanoseconds queued, start, end;
};

/// The clock of one in-order queue's device, beside the host's. A launch is queued while the host
/// makes the call: that bounds the distance between the clocks from both sides, at every launch
/// anew, so that it may change.
class DeviceClock {
 public:
  /// When the launch began. `before`, `after`: of the call. Launches must come in their order.
  Trace::Clock::time_point on_host(const DeviceTimes& device, Trace::Clock::time_point before,
                                   Trace::Clock::time_point after) {
    ahead_ = std::clamp(ahead_, before.time_since_epoch() - device.queued,
                        after.time_since_epoch() - device.queued);
    // What the bounds leave open must not let launches overlap.
    const auto start = std::max(Trace::Clock::time_point(device.start + ahead_), last_end_);
    last_end_ = start + (device.end - device.start);
    return start;
  }

 private:
  std::chrono::nanoseconds ahead_{0};  ///< the host's clock over the device's
  Trace::Clock::time_point last_end_{};
};

}  // namespace qjulia::device
