#include "fit_options.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "options.hpp"
#include "qjulia/error.hpp"

namespace qjulia::tools {
namespace {

/// As manifests spell them.
std::string option_names(const CLI::App& command) {
  std::string names = "mesh, name, surface, surface_resolution, picture, picture_size";
  for (const CLI::Option* option : command.get_options()) {
    std::string name = option->get_single_name();
    std::ranges::replace(name, '-', '_');
    names += ", " + name;
  }
  return names;
}

}  // namespace

void add_fit_options(CLI::App& command, FitArguments& a) {
  command
      .add_option("--factors", a.options.factors,
                  "Factors of the map, 8 to 20000: more follow the shape more closely, and cost "
                  "time in proportion")
      ->capture_default_str();
  add_number(command, "--detail", a.options.detail,
             "Thickness of the fractal shell as a fraction of the shape's box diagonal, 0.001 to "
             "0.1: 0.005 smooth, 0.01 first detail, 0.02 to 0.03 clearly fractal, 0.05 heavily "
             "grooved. 'surface' and 'render' can change it later")
      ->capture_default_str();
  command
      .add_option("--time-limit", a.time_limit,
                  "Seconds of the whole command; the map reached by then is saved. Default: none")
      ->type_name("SECONDS");
  command
      .add_option("--max-evaluations", a.options.max_evaluations,
                  "Most evaluations of energy and gradient; 0 is the schedule's own number")
      ->capture_default_str();
  command
      .add_option(
          "--seed", a.options.seed,
          "Seed of all random choices. The same seed, options and device give the same "
          "factors bit for bit, unless a time limit ends the fit or 'qjulia profile --tune' has "
          "changed the device's settings")
      ->check(CLI::NonNegativeNumber)
      ->type_name("INT")
      ->capture_default_str();
  command
      .add_option("--schedule", a.options.schedule,
                  "What the fit does, level by level: 'tight', 'fast' (shorter, coarser), 'paper' "
                  "(the course of Kim 2015), or a .toml file of levels")
      ->capture_default_str();
  command.add_flag("--polish", a.options.polish,
                   "Spend the last two fifths of the fit on the iterated set itself, at the wanted "
                   "detail: closer to the shape, and less rough");
  command
      .add_option("--unknowns", a.unknowns,
                  "What the fit may change: exponents alone, or exponents and centres")
      ->check(CLI::IsMember({"all", "exponents"}))
      ->capture_default_str();
  command
      .add_option("--placement", a.placement,
                  "Where factors start: 'depth' spreads them inside and about the shape, 'paper' "
                  "puts them on the surface as point charges (Kim 2015)")
      ->check(CLI::IsMember({"depth", "paper"}))
      ->capture_default_str();
  command
      .add_option("--sample-parts", a.sample_parts,
                  "Equal parts of the samples over which energies are summed; under mpirun, ranks "
                  "share them. The same number gives the same factors bit for bit on any number of "
                  "ranks. Default: the number of ranks")
      ->type_name("INT");
  command.add_option("--precision", a.precision, "Arithmetic on the device")
      ->check(CLI::IsMember({"single", "double"}))
      ->capture_default_str();
}

FitOptions checked_options(const FitArguments& arguments) {
  FitOptions options = arguments.options;
  options.unknowns = arguments.unknowns == "all" ? Unknowns::all : Unknowns::exponents;
  options.placement = arguments.placement == "paper" ? Placement::paper : Placement::depth;
  options.precision = arguments.precision == "double" ? Precision::dbl : Precision::single;
  if (arguments.sample_parts) options.sample_parts = *arguments.sample_parts;
  if (arguments.time_limit) options.time_limit = *arguments.time_limit;
  options.validate();
  return options;
}

FitOptions checked_options(const std::vector<ManifestOption>& options) {
  CLI::App command;
  command.set_help_flag();
  FitArguments arguments;
  add_fit_options(command, arguments);
  std::vector<std::string> words;
  for (const auto& [name, values, line] : options) {
    if (command.get_option_no_throw("--" + name) == nullptr) {
      throw InputError(fmt::format("'{}' is not known; what can be said of a fit is: {}", name,
                                   option_names(command)));
    }
    words.push_back(values.size() == 1 ? fmt::format("--{}={}", name, values.front())
                                       : "--" + name);
    if (values.size() > 1) words.insert(words.end(), values.begin(), values.end());
  }
  std::ranges::reverse(words);  // as CLI11 takes them
  try {
    command.parse(words);
  } catch (const CLI::ParseError& error) {
    throw InputError(error.what());
  }
  return checked_options(arguments);
}

}  // namespace qjulia::tools
