#pragma once
/// The options of a fit, as `fit` takes them on its command line and `batch` in its manifest.

#include <vector>

#include "batch/batch.hpp"
#include "command_line.hpp"
#include "qjulia/fit.hpp"

namespace qjulia::tools {

/// Everything that says how to fit; neither files nor devices.
void add_fit_options(Command command, FitOptions& options);

/// The options of a fit in a manifest, checked. @throws InputError naming the option.
FitOptions fit_options(const std::vector<batch::ManifestOption>& options);

}  // namespace qjulia::tools
