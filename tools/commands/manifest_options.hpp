#pragma once
/// The options of a fit in a batch's manifest.

#include <vector>

#include "batch/batch.hpp"
#include "qjulia/fit/fit.hpp"

namespace qjulia::tools {

/// These options, checked as those of a command line. @throws InputError naming the option.
FitOptions fit_options(const std::vector<batch::ManifestOption>& options);

}  // namespace qjulia::tools
