#include "describe/map_options.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "base/setting_json.hpp"
#include "describe/options.hpp"
#include "describe/provenance.hpp"
#include "describe/setting_option.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/edit/map_detail.hpp"
#include "qjulia/fit/fit_settings.hpp"
#include "qjulia/map/knob_table.hpp"

namespace qjulia::tools {
namespace {

constexpr const char* kGroup = "Map options";

Option add_knob(Command command, const Knob& knob, MapOptions& options) {
  if (knob.name != "detail") return add_setting(command, knob, knob.place(options.knobs));
  // A word is a value of its own, which the map decides.
  const auto take = [&options, &knob](const std::string& text) {
    const DetailChoice choice = read_detail(knob, text);
    if (const auto* word = std::get_if<DetailWord>(&choice)) {
      options.detail_word = *word;
    } else {
      options.knobs.detail = std::get<double>(choice);
    }
  };
  return command
      .word("--detail", knob.values, take,
            fmt::format("{}. Default: {}", fit_setting_named("detail").help, knob.left_out))
      .offers({"auto", "smooth", "clear", "wild"})
      .example(knob.example.words());
}

}  // namespace

const char* const kMapOptionsHelp =
    "The map's options work together, in this order: --detail, --order-seed, --phase, --slice,\n"
    "--rotate, then --drift and --translate as one move, after which the map is calibrated again,\n"
    "and --scale and --steepness last.";

void MapOptions::keep(std::initializer_list<Option> added) {
  for (const Option& option : added) options.push_back(option.group(kGroup));
}

std::vector<std::string> MapOptions::given() const {
  std::vector<std::string> names;
  for (const Option& option : options) {
    if (option.given()) names.push_back(option.name());
  }
  return names;
}

void add_knobs(Command command, MapOptions& options) {
  for (const Knob& knob : knob_table()) options.keep({add_knob(command, knob, options)});
}

Map with_knobs(const Device& device, const Map& map, const MapOptions& options,
               const std::string& file) {
  try {
    MapKnobs knobs = options.knobs;
    if (options.detail_word) {
      knobs.detail = detail_for(device, map, *options.detail_word);
    }
    return with_knobs(device, map, knobs);
  } catch (const OptionError& error) {
    throw OptionError(error.field(), fmt::format("'{}': {}", file, error.problem()));
  } catch (const InputError& error) {
    throw InputError(fmt::format("'{}': {}", file, error.what()));
  }
}

std::string unbounded_warning(const Map& map) {
  const double degree = map.dynamics.degree();
  // Far away F_1 rises by the steepness times the sum.
  if (!map.dynamics.is_rational() || map.layers.steepness * degree > 1) return {};
  return fmt::format(
      "the exponents sum to {:.3g}, and the iterated set is bounded only if their "
      "sum exceeds 1; {}",
      degree, degree > 0 && map.frame.detail ? "use a smaller --detail" : "fit the map again");
}

void warn_if_unbounded(const Map& map, int iterations, const std::string& file, Console& console) {
  const std::string warning = unbounded_warning(map);
  if (iterations > 1 && !warning.empty()) console.warn(file + ": " + warning);
}

nlohmann::json to_json(const MapOptions& options) {
  nlohmann::json json;
  base::add_json(json, knob_table(), options.knobs);
  if (options.detail_word) json["detail"] = to_string(*options.detail_word);
  return json;
}

}  // namespace qjulia::tools
