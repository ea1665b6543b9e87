#pragma once
/// The options of a fit, as commands and manifests take them.

#include "describe/command_line.hpp"
#include "qjulia/fit/fit.hpp"

namespace qjulia::tools {

/// Everything that says how to fit; neither files nor devices.
void add_fit_options(Command command, FitOptions& options);

}  // namespace qjulia::tools
