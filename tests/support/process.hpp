#pragma once
/// Runs a program as a user's shell does, and keeps what it said.

#include <chrono>
#include <csignal>
#include <map>
#include <string>
#include <vector>

namespace qjulia::test {

struct RunOptions {
  std::map<std::string, std::string> environment{};  ///< on top of this process's own
  std::chrono::seconds timeout{120};
  std::string interrupt_at{};  ///< `interrupt_by` is sent once standard error holds this; empty:
                               ///< never
  int interrupt_by = SIGINT;
  std::string kill_at{};    ///< the same for SIGKILL
  std::string kill_once{};  ///< SIGKILL is sent once a file of this name exists; empty: never
};

struct ProcessResult {
  int exit_code = -1;  ///< 128 + signal for a program that a signal ended
  bool timed_out = false;
  bool interrupted = false;  ///< whether `interrupt_at` was seen
  std::string out;
  std::string err;
};

/// @param command the program's path and its arguments.
/// @throws std::runtime_error when it cannot be started.
ProcessResult run(const std::vector<std::string>& command, const RunOptions& options = {});

/// The `qjulia` command that was built, with these arguments.
ProcessResult run_command(std::vector<std::string> arguments, const RunOptions& options = {});

}  // namespace qjulia::test
