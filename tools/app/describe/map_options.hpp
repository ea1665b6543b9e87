#pragma once
/// Options of every command that looks at a map's set: what is turned on the map before it is used,
/// and how it is iterated.

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "console/console.hpp"
#include "describe/command_line.hpp"
#include "describe/setting_option.hpp"
#include "qjulia/base/detail_choice.hpp"
#include "qjulia/map/knobs.hpp"

namespace qjulia::tools {

struct MapOptions {
  MapKnobs knobs;
  std::optional<DetailWord> detail_word;  ///< asks for a detail that the map decides

  /// The names of the options on the command line, such as "--detail".
  std::vector<std::string> given() const;

  /// Puts the parser's options into one group, and remembers them.
  void keep(std::initializer_list<Option> added);
  std::vector<Option> options;
};

/// The knobs alone. `options` must stay where it is.
void add_knobs(Command command, MapOptions& options);

/// --iterations, the knobs, --box, --escape, --precision. Both structs must stay where they are.
/// @param table the settings of `own`, the command's own options. @param what they are of.
template <class Table, class Options>
void add_map_options(Command command, MapOptions& options, const Table& table, const char* what,
                     Options& own) {
  const auto add = [&](const char* name) {
    const auto& setting = setting_named(table, name, what);
    options.keep({add_setting(command, setting, setting.place(own))});
  };
  add("iterations");
  add_knobs(command, options);
  for (const char* name : {"box", "escape", "precision"}) add(name);
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
void warn_if_unbounded(const Map& map, int iterations, const std::string& file, Console& console);

/// The knobs by name, null where not given.
nlohmann::json to_json(const MapOptions& options);

}  // namespace qjulia::tools
