#pragma once

namespace qjulia::tools {

/// What the command hands back to the shell.
enum ExitCode : int {
  kDone = 0,
  kFailed = 1,        ///< an output could not be written, or the device failed
  kBadInput = 2,      ///< usage, an option or an input file
  kNoDevice = 3,      ///< no usable OpenCL device
  kInterrupted = 130  ///< by SIGINT, SIGTERM or SIGHUP
};

}  // namespace qjulia::tools
