#pragma once
/// Jobs that run inside another command, or inside another program.

#include <optional>
#include <string>

#include "jobs/command.hpp"

namespace qjulia::tools {

/// A job that was read, and is ready to be planned and run.
class JobRun {
 public:
  /// @param output the file to make; empty: the command names it.
  /// @throws InputError where there is no such command, or an option cannot be used
  explicit JobRun(const Job& job, const std::string& output = {}, const TrustedDevice& device = {});

  /// What files will say of how they were made: the job, which calls files by their names alone.
  const Job& kept() const { return chosen_.job; }
  /// Checks all that can be checked before files are read. @throws InputError
  Plan plan() const;
  /// Plans and runs it. @return the exit code. @throws what the command does
  int run(Session& session) const;

 private:
  CommandLine program_;
  ChosenCommand chosen_;
};

/// Runs a job where `place` says. @param kept what files say of how they were made; none: the job,
/// as `JobRun::kept`. @return what the command said. @throws what the command does; Error where it
/// did not throw, and
///   yet failed
Said run_job(const Job& job, const std::string& output, JobPlace place,
             const std::optional<Job>& kept = std::nullopt);

}  // namespace qjulia::tools
