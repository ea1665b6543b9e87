#pragma once
/// What this program was built of, for reports of errors.

#include <string>

namespace qjulia::tools {

/// A few lines: the compiler, the build's type and commit, and the libraries with their versions.
std::string build_facts();

}  // namespace qjulia::tools
