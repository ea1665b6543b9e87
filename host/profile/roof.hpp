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

/// Why a share is not judged.
enum class Doubt {
  none,
  spread,          ///< its runs lie too far apart
  other_programs,  ///< they may have changed it
  above_limit      ///< it is more than the limit beside it, which was disturbed
};

/// A share and its interval, or why there is none.
struct JudgedShare {
  std::optional<double> share;      ///< if the verdict is "judged"
  std::optional<double> low, high;  ///< its interval; what was seen if the verdict is "not now"
  std::string verdict;              ///< as in KernelFigures::share_verdict
  std::string limit;                ///< as it was given
  Doubt doubt = Doubt::none;

  bool is_judged() const { return share.has_value(); }
  /// The share, or the middle of those seen.
  std::optional<double> seen() const;
};

/// One that reaches this share of its ceiling is bound by it.
constexpr double kAtCeiling = 0.8;

/// Shares of the multiply-adds that a kernel's instructions allow.
struct CodeBounds {
  double ceiling = 1;
  double from_memory = 0;  ///< if all of its data comes from there
};

/// A share of multiply-adds that other programs may have changed is not judged: CPU seconds leave
/// out the time that they took, but not the data that they drove out of the caches. A kernel may
/// wait for it that is below its ceiling, but not below what memory allows.
/// @param shares none where no work is known.
/// @param is_busy whether other programs took the processors while it was measured.
/// @param bounds none where its instructions are not known.
JudgedShare judged(const std::string& limit, bool is_at_most, const std::optional<Interval>& shares,
                   bool is_busy, const std::optional<CodeBounds>& bounds);

/// Threads that wait for longer than this share of their time do so because of other programs.
constexpr double kUsualWait = 0.05;
/// How far the limit drifts on an idle machine between two measurements.
constexpr double kUsualDrift = 0.05;

/// A sentence for each sign that other programs disturbed what was measured between two limits.
std::vector<std::string> signs_of_load(double fma_before, double fma_after,
                                       const std::optional<double>& waited_share,
                                       const std::optional<ProcessorUse>& use);

}  // namespace qjulia::profiling
