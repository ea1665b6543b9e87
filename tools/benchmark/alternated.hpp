#pragma once
/// Two builds of the program, profiled in turns until each kernel is decided.

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "benchmark/profile_comparison.hpp"

namespace qjulia::benchmark {

/// Profiles the kernels of these names (all, if there are none) with one build, in a process of its
/// own. @return the JSON of `qjulia profile measure`.
using ProfileOnce = std::function<nlohmann::json(const std::vector<std::string>& names)>;

struct Alternation {
  ProfileOnce old_build, new_build;
  /// Whether the time is over.
  std::function<bool()> is_over;
  /// Called after each round with how many kernels are still open.
  std::function<void(int rounds, std::size_t open)> on_round;
};

struct AlternatedComparison {
  ProfileComparison comparison;
  int rounds = 0;
  int least_rounds = 0;  ///< that allow any bound, for all kernels at this confidence
};

/// Runs both builds in turns, the one that begins changing from round to round. A process counts as
/// one run of each kernel, because memory addresses and temperature vary between processes more
/// than within one. Its fastest run and its highest multiply-add limit represent it, by either
/// clock. On a virtual machine that shares its host, these vary a third less between processes than
/// medians do (docs/lab/performance.md). After the sixth round and then ever more rarely each open
/// kernel is compared as in `compare_profiles`. It is decided when it is slower or faster, or when
/// its upper bound is within the tolerance. The k-th look spends 1 / (k (k + 1)) of the error that
/// the confidence allows, so that all looks together keep to it. Kernels for which the time did not
/// suffice have no ratio, and are undecided.
/// @throws InputError as compare_profiles does.
AlternatedComparison compare_alternated(const Alternation& builds,
                                        const ComparisonOptions& options);

}  // namespace qjulia::benchmark
