#pragma once
/// The options of a fit, as `fit` takes them on its command line and `batch` in its manifest.

#include <optional>

#include "batch/batch.hpp"
#include "command_line.hpp"
#include "qjulia/fit.hpp"

namespace qjulia::tools {

/// What was typed, before it is checked.
struct FitArguments {
  std::optional<double> time_limit;
  std::optional<int> max_factors;
  std::optional<int> sample_parts;
  FitOptions options;
};

/// --factors and --time-limit.
void add_fit_size(Command command, FitArguments& arguments, const char* time_limit_help);

/// Everything that says how to fit; neither files nor devices.
void add_fit_options(Command command, FitArguments& arguments);

/// @throws InputError naming the option.
FitOptions checked_options(const FitArguments& arguments);

/// The same from a manifest. @throws InputError naming the option.
FitOptions checked_options(const std::vector<batch::ManifestOption>& options);

}  // namespace qjulia::tools
