#pragma once
/// Options that several commands share, and how their values are checked.

#include <CLI/CLI.hpp>
#include <array>
#include <string>

#include "console.hpp"

namespace qjulia::tools {

/// --quiet, --verbose, --json.
void add_verbosity(CLI::App& command, Verbosity& verbosity);

/// --device.
void add_device(CLI::App& command, std::string& device);

/// --trace.
void add_trace(CLI::App& command, std::string& file);

/// Accepts finite real numbers.
CLI::Validator finite();

/// A finite real number.
CLI::Option* add_number(CLI::App& command, const std::string& name, double& value,
                        const std::string& description);

/// "1280x960" as width and height. @throws CLI::ValidationError
std::array<int, 2> parse_size(const std::string& text);

}  // namespace qjulia::tools
