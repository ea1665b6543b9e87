#pragma once
/// Options that make a mesh ready for a printer, and what is said of it.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "describe/command_line.hpp"
#include "qjulia/surface/print.hpp"

namespace qjulia::tools {

/// --height, --longest, --max-triangles, --max-error, --min-wall, --flat-foot, --shell, --drain.
/// Lengths are not given together with --metres. @param millimetres, metres what else scales
/// meshes.
void add_print_options(Command command, PrintOptions& options, const Option& millimetres,
                       const Option& metres);

/// Those that are given, by their names with underscores.
nlohmann::json print_json(const PrintOptions& options);

/// Lines, each after a line break, and figures.
std::string print_text(const PrintReport& report, const PrintOptions& options);
nlohmann::json print_json(const PrintReport& report, const PrintOptions& options);

}  // namespace qjulia::tools
