#pragma once
/// Options that several commands share, and how their values are checked.

#include <CLI/CLI.hpp>
#include <array>
#include <optional>
#include <string>

#include "console.hpp"
#include "qjulia/rational_map.hpp"

namespace qjulia::tools {

/// --quiet, --verbose, --json.
void add_verbosity(CLI::App& command, Verbosity& verbosity);

/// --device.
void add_device(CLI::App& command, std::string& device);

/// A finite real number.
CLI::Option* add_number(CLI::App& command, const std::string& name, double& value,
                        const std::string& description);

/// Options that change a map before it is used.
struct MapChanges {
  std::optional<double> detail;  ///< δ, fraction of the box's diagonal
};
/// --detail.
void add_map_changes(CLI::App& command, MapChanges& changes);
/// @throws InputError naming the option and `file`.
RationalMap changed(const RationalMap& map, const MapChanges& changes, const std::string& file);

/// "1280x960" as width and height. @throws CLI::ValidationError
std::array<int, 2> parse_size(const std::string& text);

}  // namespace qjulia::tools
