#include "fit_options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "map_options.hpp"
#include "options.hpp"
#include "qjulia/error.hpp"

namespace qjulia::tools {
namespace {

/// The option's name as manifests spell it.
std::string spelled(std::string name) {
  std::ranges::replace(name, '-', '_');
  return name;
}

std::string option_names(const CommandLine& command) {
  std::string names = fmt::format("{}", fmt::join(batch::manifest_keys(), ", "));
  for (const std::string& name : command.option_names()) names += ", " + spelled(name);
  return names;
}

}  // namespace

void add_fit_size(Command command, FitArguments& a, const char* time_limit_help) {
  const auto read_factors = [&a](const std::string& text) {
    a.options.factors.reset();
    if (text != "auto") a.options.factors = whole_number(text);
  };
  command
      .word("--factors", "NUMBER|auto", read_factors,
            "Factors of the map, 8 to 20000, or 'auto': as many as settle in the time limit on "
            "this device, or as the schedule says where there is none. More follow the shape more "
            "closely; the fit, surfaces and pictures take longer")
      .default_text("auto")
      .offers({"auto"});
  command.add("--time-limit", &a.time_limit, "SECONDS", time_limit_help);
}

void add_fit_options(Command command, FitArguments& a) {
  add_fit_size(command, a,
               "Seconds of the whole command (with --resume, of this run); the map reached by then "
               "is saved. Default: none");
  command
      .add("--max-factors", &a.max_factors, "INT",
           "The largest number that 'auto' stands for, 8 to 20000")
      .default_text(fmt::format("{}", a.options.max_factors));
  add_detail(command, a.options.detail);
  add_steepness_and_up(command, a.options.steepness, a.options.up);
  command.add("--target-iou", &a.options.target_iou, "NUMBER",
              "End after the first stage whose map has this IoU or more on a grid of 48 cells a "
              "side; above 0, at most 1. Default: none");
  command.add("--max-evaluations", &a.options.max_evaluations, "INT",
              "Maximum number of evaluations of energy and gradient. Default: the schedule's own");
  command.add("--seed", &a.options.seed, "INT",
              "Seed of all random choices. The same seed, options and device give the same factors "
              "bit for bit, unless a time limit ends the fit or 'qjulia profile --tune' has "
              "changed the device's settings");
  command
      .add("--schedule", &a.options.schedule, "TEXT",
           "What the fit does, level by level: 'tight', 'fast' (shorter, coarser), 'paper' (the "
           "course of Kim 2015), or a .toml file of levels")
      .offers({"tight", "fast", "paper"})
      .offers_files({".toml"});
  command.flag("--polish", a.options.polish,
               "Spend the last two fifths of the fit on the iterated set itself, at the wanted "
               "detail: closer to the shape, and less rough");
  command.choice("--unknowns", a.options.unknowns,
                 {{"all", Unknowns::all}, {"exponents", Unknowns::exponents}},
                 "What the fit may change: exponents alone, or exponents and centres");
  command.choice("--placement", a.options.placement,
                 {{"depth", Placement::depth}, {"paper", Placement::paper}},
                 "Where factors start: 'depth' spreads them inside and about the shape, 'paper' "
                 "puts them on the surface as point charges (Kim 2015)");
  command.add("--sample-parts", &a.sample_parts, "INT",
              "Equal parts of the samples over which energies are summed; under mpirun, ranks "
              "share them. The same number gives the same factors bit for bit on any number of "
              "ranks. Default: the number of ranks");
  add_precision(command, a.options.precision, "Arithmetic on the device");
}

FitOptions checked_options(const FitArguments& arguments) {
  FitOptions options = arguments.options;
  if (arguments.max_factors) {
    if (options.factors) {
      throw OptionError("max_factors",
                        fmt::format("it bounds the number that 'auto' chooses, and {} factors are "
                                    "asked for; leave out one of the two",
                                    *options.factors));
    }
    options.max_factors = *arguments.max_factors;
  }
  if (arguments.sample_parts) options.sample_parts = *arguments.sample_parts;
  if (arguments.time_limit) options.time_limit = *arguments.time_limit;
  options.validate();
  return options;
}

FitOptions checked_options(const std::vector<batch::ManifestOption>& options) {
  CommandLine command;
  FitArguments arguments;
  add_fit_options(command.root(), arguments);
  std::vector<std::string> words;
  for (const auto& [name, values, line] : options) {
    if (!command.has_option(name)) {
      throw InputError(fmt::format("'{}' is not known; the options of a fit are: {}", spelled(name),
                                   option_names(command)));
    }
    if (command.is_flag(name) != values.empty()) {
      throw InputError(
          fmt::format("'{}' must be {}", spelled(name),
                      values.empty() ? "a number or a string, not true" : "true or false"));
    }
    if (!values.empty() && values.front().empty()) {
      throw InputError(fmt::format("'{}' is empty; give a value, or leave it out", spelled(name)));
    }
    words.push_back(values.empty() ? "--" + name : fmt::format("--{}={}", name, values.front()));
  }
  command.parse(std::move(words));
  return checked_options(arguments);
}

}  // namespace qjulia::tools
