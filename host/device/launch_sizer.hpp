#pragma once
/// How much work a launch of one kernel may have.

#include <algorithm>

#include "qjulia/device/device.hpp"

namespace qjulia::device {

/// The work that takes about 80 ms, in a unit of the kernel's own: short enough for the watchdog of
/// a display and for a stop request, long enough that the launch itself costs nothing. Until a
/// launch has been timed, it is a small part of that, even on a slow device.
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
    const double growth = is_timed_ ? 2 : kFirstGrowth;
    work_ = std::max(kLeastWork, std::clamp(fitting, work_ / growth, growth * work_));
    is_timed_ = true;
  }

 private:
  static constexpr double kSeconds = 0.08;
  static constexpr double kFirstWorkPerUnit = 1U << 21;  ///< takes CPUs some milliseconds
  static constexpr double kFirstGrowth = 32;
  static constexpr double kLeastWork = 1;

  double work_ = kFirstWorkPerUnit;
  bool is_timed_ = false;
};

}  // namespace qjulia::device
