#pragma once
/// Another program, run for what it prints.

#include <map>
#include <stop_token>
#include <string>
#include <vector>

namespace qjulia::tools {

struct ChildOutput {
  int exit_code = 0;  ///< 128 and the signal's number where a signal ended it
  int signal = 0;     ///< that ended it; 0: none
  std::string out{}, err{};
};

/// Runs a program to its end, or until a stop is requested, which ends it too.
/// @param words the program's path and its arguments.
/// @param environment variables on top of this process's own.
/// @throws InputError when it cannot be started; Interrupted
ChildOutput child_output(const std::vector<std::string>& words, const std::stop_token& stop,
                         const std::map<std::string, std::string>& environment = {});

}  // namespace qjulia::tools
