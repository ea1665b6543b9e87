#pragma once
/// What a launch of a kernel goes over.

#include <cstddef>

namespace qjulia {

/// So many maps or matrices side by side, each of so many terms, at so many points.
struct LaunchSize {
  std::size_t parts = 1;
  std::size_t terms = 0;              ///< of each part; 0: nothing is known
  const char* terms_are = "factors";  ///< or "unknowns", the order of a matrix
  std::size_t points = 0;             ///< samples, or other points
};

/// Those of several launches of one kernel: the one with the least work and the one with the most.
struct LaunchSizes {
  LaunchSize least, most;
};

}  // namespace qjulia
