#pragma once
/// Options that make a mesh ready for a printer, and what is said of it.

#include <initializer_list>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "command_line.hpp"
#include "qjulia/print.hpp"

namespace qjulia::tools {

/// --height, --longest, --max-triangles, --max-error, --min-wall, --flat-foot, --shell, --drain.
/// @param sizes the other options that scale the mesh, which --height and --longest exclude.
void add_print_options(Command command, PrintOptions& options, std::initializer_list<Option> sizes);

/// Those that are given, by their names with underscores.
nlohmann::json print_json(const PrintOptions& options);

/// Lines, each after a line break, and figures.
std::string print_text(const PrintReport& report, const PrintOptions& options);
nlohmann::json print_json(const PrintReport& report, const PrintOptions& options);

}  // namespace qjulia::tools
