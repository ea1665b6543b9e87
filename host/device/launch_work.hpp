#pragma once
/// What a launch has to do. The code that launches a kernel says it, and profiles read it.

#include "qjulia/device/launch_size.hpp"

namespace qjulia::device {

struct LaunchWork {
  double slots;  ///< multiply-adds, multiplications and divisions (map/cost.hpp); 0: not known
  double reals;  ///< of the kernel's precision, read and written at least; 0: not known
  bool at_most;  ///< orbits may end before they have done all of it
  LaunchSize size;

  /// There is no default: a launch without its work does not compile.
  constexpr LaunchWork(double slots_of_all, double reals_of_all, bool is_at_most = false,
                       const LaunchSize& of_size = {})
      : slots(slots_of_all), reals(reals_of_all), at_most(is_at_most), size(of_size) {}
};

/// The work of kernels whose arithmetic is little beside what they read and write.
constexpr LaunchWork moving(double reals) { return {0, reals}; }

/// Of probes and checks, which no profile looks at.
inline constexpr LaunchWork kNotCounted{0, 0};

}  // namespace qjulia::device
