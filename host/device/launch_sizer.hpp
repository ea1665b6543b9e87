#pragma once
/// How much work a launch of one kernel may have.

#include <algorithm>

#include "qjulia/device.hpp"

namespace qjulia::device {

/// The work that takes about 80 ms, in a unit of the kernel's own: short enough for the watchdog of
/// a display and for a stop request, long enough that the launch itself costs nothing.
class LaunchSizer {
 public:
  LaunchSizer() = default;
  /// The first guess, for units that cost about as much as a logarithm.
  explicit LaunchSizer(const DeviceInfo& info)
      : work_(kFirstWorkPerUnit * std::max(1U, info.compute_units)) {}

  double work() const { return work_; }

  void learn(double work, double seconds) {
    // A launch of less can be bound by what any launch costs.
    if (work < 0.5 * work_ && seconds < kSeconds) return;
    const double fitting = work * kSeconds / std::max(seconds, 1e-6);
    work_ = std::max(kLeastWork, std::clamp(fitting, 0.5 * work_, 2 * work_));
  }

 private:
  static constexpr double kSeconds = 0.08;
  static constexpr double kFirstWorkPerUnit = 1U << 25;
  static constexpr double kLeastWork = 1;

  double work_ = kFirstWorkPerUnit;
};

}  // namespace qjulia::device
