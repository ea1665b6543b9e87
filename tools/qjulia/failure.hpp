#pragma once
/// Errors as the shell and its user see them.

#include <exception>
#include <string>

namespace qjulia::tools {

/// What the command hands back to the shell.
enum ExitCode : int {
  kDone = 0,
  kFailed = 1,        ///< an output could not be written, or the device failed
  kBadInput = 2,      ///< usage, an option or an input file
  kNoDevice = 3,      ///< no usable OpenCL device
  kInterrupted = 130  ///< by SIGINT, SIGTERM or SIGHUP
};

int exit_code_of(const std::exception& error);

/// What is wrong and what to do, in the command line's words.
std::string message_of(const std::exception& error);

/// To standard error.
void say(const std::exception& error);

}  // namespace qjulia::tools
