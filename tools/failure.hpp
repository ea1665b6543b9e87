#pragma once
/// Errors as the shell and its user see them.

#include <exception>

namespace qjulia::tools {

int exit_code_of(const std::exception& error);

/// To standard error.
void say(const std::exception& error);

}  // namespace qjulia::tools
