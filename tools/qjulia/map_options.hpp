#pragma once
/// Options of every command that looks at a map's set: what is turned on the map before it is used,
/// and how it is iterated.

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "command_line.hpp"
#include "qjulia/knobs.hpp"

namespace qjulia::tools {

struct MapOptions {
  MapKnobs knobs;
  int iterations = 6;
  std::optional<Box> box;        ///< shape units
  std::optional<double> escape;  ///< map units
  Precision precision = Precision::single;

  /// Those on the command line, by name: "--detail".
  std::vector<std::string> given() const;

  std::vector<Option> options;  ///< the parser's
};

/// The knobs alone. `options` must stay where it is.
void add_knobs(Command command, MapOptions& options);

/// --iterations and the knobs. `options` must stay where it is.
void add_map_options(Command command, MapOptions& options);

/// --box. @param otherwise what holds without it.
void add_box(Command command, MapOptions& options, const std::string& otherwise);

/// --precision.
void add_precision(Command command, MapOptions& options);

/// --escape. @param otherwise what holds without it.
void add_escape(Command command, MapOptions& options, const std::string& otherwise);

/// The escape radius of commands that look at the set: what add_escape() says of it.
extern const char* const kDefaultEscape;

/// How these options act together, for the end of a command's help.
extern const char* const kMapOptionsHelp;

/// The map with its knobs turned. @throws InputError naming the option and `file`.
RationalMap with_knobs(const Device& device, const RationalMap& map, const MapOptions& options,
                       const std::string& file);

/// The options by name, null where not given.
nlohmann::json to_json(const MapOptions& options);

/// Low and high corner.
nlohmann::json to_json(const Box& box);

}  // namespace qjulia::tools
