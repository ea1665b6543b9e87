#pragma once
/// What share of a device's limits a kernel reached.

#include <optional>
#include <string>
#include <vector>

#include "profile/command_profile.hpp"
#include "profile/interval.hpp"

namespace qjulia::profiling {

/// The time that a kernel took.
struct Spent {
  double seconds = 0;      ///< by the device's clock
  double cpu_seconds = 0;  ///< of the threads that ran it; 0 where they are not known
};

struct Roof {
  std::string limit;            ///< "fma" or "memory"; empty where no work is known
  std::optional<double> share;  ///< of what the device can do in the time
};

/// The share of the limit that work of this duration reached, for whichever limit would take
/// longer. A share of the multiply-adds is one of CPU seconds where they are known; all processors
/// of a device share its memory, so a share of the copy is always one of the device's seconds.
Roof roof_of(const KernelWork& work, const Spent& spent, const Roofs& roofs);

/// A share and its interval, or why there is none.
struct JudgedShare {
  std::optional<double> share, low, high;
  std::string verdict;  ///< as in KernelFigures::share_verdict
  std::string limit;    ///< as it was given
};

/// One that reaches this share of its ceiling is bound by it.
constexpr double kAtCeiling = 0.8;

/// A share of multiply-adds that other programs may have changed is not judged: CPU seconds leave
/// out the time that they took, but not the data that they drove out of the caches, for which a
/// kernel below its ceiling may wait.
/// @param shares none where no work is known.
/// @param is_busy whether other programs took the processors while it was measured.
/// @param ceiling that its instructions allow; none where they are not known.
JudgedShare judged(const std::string& limit, bool is_at_most, const std::optional<Interval>& shares,
                   bool is_busy, const std::optional<double>& ceiling);

/// Threads that wait for longer than this share of their time do so because of other programs.
constexpr double kUsualWait = 0.05;
/// How far the limit drifts on an idle machine between two measurements.
constexpr double kUsualDrift = 0.05;

/// A sentence for each sign that other programs disturbed what was measured between two limits.
std::vector<std::string> signs_of_load(double fma_before, double fma_after,
                                       const std::optional<double>& waited_share);

}  // namespace qjulia::profiling
