#include "map_options.hpp"

#include <fmt/format.h>

#include <functional>
#include <nlohmann/json.hpp>

#include "options.hpp"
#include "provenance.hpp"
#include "qjulia/error.hpp"
#include "qjulia/knob_table.hpp"
#include "qjulia/map_detail.hpp"
#include "qjulia/picture_settings.hpp"
#include "setting_json.hpp"

namespace qjulia::tools {
namespace {

constexpr const char* kGroup = "Map options";

/// Takes a number or a word.
Option add_detail(Command command, std::function<void(const DetailChoice&)> take,
                  const std::string& description) {
  const auto read = [take = std::move(take)](const std::string& text) {
    for (const auto word :
         {DetailWord::automatic, DetailWord::smooth, DetailWord::clear, DetailWord::wild}) {
      if (text == to_string(word)) return take(word);
    }
    double number = 0;
    try {
      number = finite_number(text);
    } catch (const InputError& error) {
      throw InputError(fmt::format("{}; give one, or auto, smooth, clear or wild", error.what()));
    }
    knob_named("detail").expect_in_range(number);
    take(number);
  };
  return command
      .word("--detail", "WORD|FRACTION", read,
            "Thickness of the fractal shell: 'auto' gives the set a roughness of about 1.2 on a "
            "grid of "
            "256 cells, by how unevenly the shape's radii are spread; 'smooth' is an eighth of it, "
            "'clear' half, 'wild' twice as much. Or a number, the fraction of the shape's box "
            "diagonal, "
            "from 0.0001 to 0.1: at 0.02 a round body is clearly grooved, at 0.01 a thin figure "
            "(in an "
            "exact map at half of that). " +
                description)
      .offers({"auto", "smooth", "clear", "wild"});
}

/// The option that turns a knob by numbers.
class KnobOption {
 public:
  KnobOption(Command command, const Knob& knob, MapKnobs& knobs)
      : command_(command), knob_(knob), knobs_(knobs) {}

  template <class Number>
  Option operator()(std::optional<Number> MapKnobs::*member) const {
    return command_.add(name(), &(knobs_.*member), knob_.values, help());
  }
  Option operator()(std::optional<Eigen::Vector3d> MapKnobs::*member) const {
    return add_vector(command_, name(), knobs_.*member, help());
  }
  Option operator()(std::optional<Quaternion> MapKnobs::*member) const {
    return numbers([&value = knobs_.*member](const std::vector<double>& v) {
      value = Quaternion{v[0], v[1], v[2], v[3]};
    });
  }
  Option operator()(std::optional<Rotation> MapKnobs::*member) const {
    return numbers([&value = knobs_.*member](const std::vector<double>& v) {
      value = Rotation{{v[0], v[1], v[2]}, v[3]};
    });
  }

 private:
  std::string name() const { return "--" + knob_.option(); }
  std::string help() const {
    return knob_.is_kept ? knob_.help + ". Default: the map's own" : knob_.help;
  }
  Option numbers(std::function<void(const std::vector<double>&)> take) const {
    return command_.numbers(name(), knob_.values, std::move(take), help());
  }

  Command command_;
  const Knob& knob_;
  MapKnobs& knobs_;
};

Option add_knob(Command command, const Knob& knob, MapOptions& options) {
  if (knob.name != "detail")
    return std::visit(KnobOption(command, knob, options.knobs), knob.value);
  const auto take = [&options](const DetailChoice& choice) {
    if (const auto* word = std::get_if<DetailWord>(&choice)) {
      options.detail_word = *word;
    } else {
      options.knobs.detail = std::get<double>(choice);
    }
  };
  return add_detail(command, take, "Default: the map's own");
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

void add_detail(Command command, DetailChoice& detail) {
  add_detail(
      command, [&detail](const DetailChoice& given) { detail = given; },
      "'surface' and 'render' can change it later")
      .default_text(to_string(detail));
}

void add_steepness_and_up(Command command, double& steepness, std::optional<UpAxis>& up) {
  command.add("--steepness", &steepness, "NUMBER",
              knob_named("steepness").help + ". 'surface' and 'render' can change it later");
  add_up(command, up,
         "The mesh's axis that points up in pictures, and in files that have an up of their own. "
         "auto: the mesh's flattest, widest end is down; where none is, z is up in .stl and .3mf "
         "files and y in others");
}

void add_knobs(Command command, MapOptions& options) {
  for (const Knob& knob : knob_table()) options.keep({add_knob(command, knob, options)});
}

void add_map_options(Command command, MapOptions& options, const std::string& box,
                     const std::string& escape) {
  const PictureSetting& iterations = picture_setting_named("iterations");
  options.keep(
      {command.add("--iterations", &options.iterations, iterations.values, iterations.help)});
  add_knobs(command, options);
  options.keep({
      add_box(command, "--box", options.box, "Part of space to look at, shape units. " + box),
      command.add("--escape", &options.escape, "R",
                  "Radius, map units, beyond which an orbit ends as outside: a radius smaller than "
                  "the set's own cuts into it. " +
                      escape),
      add_precision(command, options.precision,
                    "Arithmetic of the orbits: single, or double where the device has it"),
  });
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

void warn_if_unbounded(const Map& map, const MapOptions& options, const std::string& file,
                       Console& console) {
  const std::string warning = unbounded_warning(map);
  if (options.iterations > 1 && !warning.empty()) console.warn(file + ": " + warning);
}

nlohmann::json to_json(const MapOptions& options) {
  nlohmann::json json = {{"iterations", options.iterations},
                         {"precision", to_string(options.precision)},
                         {"box", value_json(options.box)},
                         {"escape", value_json(options.escape)}};
  for (const Knob& knob : knob_table()) {
    std::visit([&](const auto member) { json[knob.name] = value_json(options.knobs.*member); },
               knob.value);
  }
  if (options.detail_word) json["detail"] = to_string(*options.detail_word);
  return json;
}

}  // namespace qjulia::tools
