#pragma once
/// Errors as the shell and its user see them.

#include <exception>
#include <string>

namespace qjulia::tools {

int exit_code_of(const std::exception& error);

/// The option that sets a field of an options struct: "max_evaluations" is "--max-evaluations".
std::string option_name(std::string field);

/// What is wrong and what to do, in the command line's words.
std::string message_of(const std::exception& error);

/// To standard error.
void say(const std::exception& error);

}  // namespace qjulia::tools
