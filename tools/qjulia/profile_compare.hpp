#pragma once
/// qjulia profile compare: two profiles, kernel by kernel.

#include <string>

#include "benchmark/profile_comparison.hpp"
#include "session.hpp"

namespace qjulia::tools {

/// Shows what became of each kernel from the profile in file `before` to that in `after`.
/// @return kDone when none is slower, kFailed when any is, kUndecided when the machine was too busy
/// or runs differ too much.
/// @throws InputError naming the file that cannot be read, or what cannot be compared.
int compare_profiles(const std::string& before, const std::string& after,
                     const benchmark::ComparisonOptions& options, Session& session);

/// The rounds that a comparison has measured itself.
struct Rounds {
  int made = 0;        ///< 0: it has measured nothing
  int least = 0;       ///< that allow any bound
  double seconds = 0;  ///< that those which were made took
};

/// Shows a comparison. @return as above.
int show_comparison(const benchmark::ProfileComparison& comparison,
                    const benchmark::ComparisonOptions& options, const Rounds& rounds,
                    Session& session);

}  // namespace qjulia::tools
