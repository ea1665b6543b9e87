#pragma once
/// The profile of a kernel of your own.

#include <functional>
#include <string>

#include "qjulia/base/progress.hpp"
#include "qjulia/profile/profile.hpp"

namespace qjulia {

/// A launch, and what it has to do.
struct OwnLaunch {
  /// Its name in the source, by which PoCL's machine code of it is found.
  std::string kernel;
  /// Launches it on any queue of the device and waits for its end, as with clFinish. It is called
  /// until enough is measured.
  std::function<void()> run;
  double slots = 0;      ///< multiply-adds, multiplications and divisions of a run; 0: not known
  double bytes = 0;      ///< read and written at least; 0: not known
  bool at_most = false;  ///< a run may end before it has done all of it, as orbits do that escape
  Precision precision = Precision::single;
  int repeats = 5;  ///< timed runs, after one that is not
  /// @throws OptionError for no call, numbers that are negative or not finite, or repeats out of 1
  /// … 1000
  void validate() const;
};

/// Measures the launch as `profile` measures the kernels of a map: its share of the limits measured
/// beside each run, and what limits it. Seconds are the host's, from the call to its end, since the
/// queue may be the caller's. Samples, factors, n and width stay as they are by default.
KernelFigures profile_launch(const Device& device, const OwnLaunch& launch,
                             const ProgressMonitor& monitor = {});

}  // namespace qjulia
