#pragma once
/// Options of every command that looks at a map's set: what is turned on the map before it is used,
/// and how it is iterated.

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "command_line.hpp"
#include "console.hpp"
#include "qjulia/detail_choice.hpp"
#include "qjulia/knobs.hpp"
#include "qjulia/orbit_settings.hpp"

namespace qjulia::tools {

struct MapOptions {
  MapKnobs knobs;
  std::optional<DetailWord> detail_word;  ///< asks for a detail that the map decides
  int iterations = 6;
  std::optional<Box> box;        ///< shape units
  std::optional<double> escape;  ///< map units
  Precision precision = Precision::single;

  /// The names of the options on the command line, such as "--detail".
  std::vector<std::string> given() const;

  /// Puts the parser's options into one group, and remembers them.
  void keep(std::initializer_list<Option> added);
  std::vector<Option> options;
};

/// The knobs alone. `options` must stay where it is.
void add_knobs(Command command, MapOptions& options);

/// All of them: --iterations, the knobs, --box, --escape, --precision. `options` must stay where it
/// is.
/// @param box, escape as the command's own table describes them.
void add_map_options(Command command, MapOptions& options, const Setting& box,
                     const Setting& escape = escape_setting());

/// A command's own options with what was given here. @throws InputError where either cannot be
/// used.
template <class Options>
Options checked(Options own, const MapOptions& options) {
  own.iterations = options.iterations;
  own.box = options.box;
  if (options.escape) own.escape = *options.escape;
  own.precision = options.precision;
  options.knobs.validate();
  own.validate();
  return own;
}

/// How these options act together, for the end of a command's help.
extern const char* const kMapOptionsHelp;

/// The map with its knobs turned. @throws InputError naming the option and `file`.
Map with_knobs(const Device& device, const Map& map, const MapOptions& options,
               const std::string& file);

/// A warning that a rational map's set is unbounded, with what to do; empty where its exponents sum
/// to more than 1.
std::string unbounded_warning(const Map& map);

/// Shows that warning if n > 1. @param file of the map.
void warn_if_unbounded(const Map& map, const MapOptions& options, const std::string& file,
                       Console& console);

/// The options by name, null where not given.
nlohmann::json to_json(const MapOptions& options);

}  // namespace qjulia::tools
