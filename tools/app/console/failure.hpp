#pragma once
/// Errors as the shell and its user see them.

#include <exception>
#include <span>
#include <string>

namespace qjulia::tools {

/// What the command hands back to the shell.
enum ExitCode : int {
  kDone = 0,
  kFailed = 1,        ///< an output could not be written, or the device failed
  kBadInput = 2,      ///< usage, an option or an input file
  kNoDevice = 3,      ///< no usable OpenCL device
  kUndecided = 4,     ///< a comparison of profiles without a verdict
  kInterrupted = 130  ///< by SIGINT, SIGTERM or SIGHUP
};

struct ExitStatus {
  ExitCode code;
  const char* meaning;  ///< for help
  const char* details;  ///< what else is to be said of it
};

/// Every code, with what it means.
std::span<const ExitStatus> exit_statuses();

int exit_code_of(const std::exception& error);

/// What is wrong and what to do, in the command line's words.
std::string message_of(const std::exception& error);

/// To standard error.
void say(const std::exception& error);

}  // namespace qjulia::tools
