#pragma once
/// The profile of a kernel of your own.

#include <functional>
#include <string>

#include "qjulia/base/progress.hpp"
#include "qjulia/profile/profile.hpp"

namespace qjulia {

/// A launch of your kernel, and the work that a run of it does.
struct OwnLaunch {
  /// The kernel's name in its source. PoCL's machine code is found by it.
  std::string kernel;
  /// Launches the kernel on a queue of the device and waits until it has ended, as clFinish does.
  /// It is called as often as measuring needs.
  std::function<void()> run;
  double slots = 0;      ///< multiply-adds, multiplications and divisions of a run; 0: not known
  double bytes = 0;      ///< read and written at least; 0: not known
  bool at_most = false;  ///< a run may end before it has done all of it, as orbits do that escape
  Precision precision = Precision::single;
  int repeats = 5;  ///< timed runs, after one that is not timed
  /// @throws OptionError where `run` is empty, a number is negative or not finite, or `repeats` is
  /// not within 1 … 1000
  void validate() const;
};

/// Measures the launch as `profile` measures the kernels of a map: its share of the limits that are
/// measured beside each run, and what limits it. Seconds are the host's, from the beginning of
/// `run` to its end, since the queue may be the caller's. `samples`, `factors`, `iterations` and
/// `width` of the figures keep their defaults.
KernelFigures profile_launch(const Device& device, const OwnLaunch& launch,
                             const ProgressMonitor& monitor = {});

}  // namespace qjulia
