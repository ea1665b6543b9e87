#pragma once
/// What `qjulia profile compare` and `against` show.

#include "benchmark/profile_comparison.hpp"
#include "describe/command_line.hpp"
#include "jobs/session.hpp"

namespace qjulia::tools {

/// The rounds that a comparison has measured itself.
struct Rounds {
  int made = 0;        ///< 0: it has measured nothing
  int least = 0;       ///< that allow any bound
  double seconds = 0;  ///< that those which were made took
};

/// What a comparison is made with.
struct ComparisonArguments {
  benchmark::ComparisonOptions options;
  bool across_drivers = false, across_devices = false;

  /// @throws InputError
  benchmark::ComparisonOptions checked() const;
};

/// --confidence, --across-drivers, --across-devices.
void add_comparison(Command command, ComparisonArguments& arguments);

/// How verdicts are found and what the exit codes are, for the help.
extern const char* const kComparisonHelp;

/// Shows a comparison.
/// @return kDone when none is slower, kFailed when any is, kUndecided when the machine was too busy
/// or runs differ too much.
int show_comparison(const benchmark::ProfileComparison& comparison,
                    const benchmark::ComparisonOptions& options, const Rounds& rounds,
                    Session& session);

}  // namespace qjulia::tools
