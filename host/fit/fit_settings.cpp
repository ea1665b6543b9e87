#include "qjulia/fit/fit_settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include "fit/factor_count.hpp"
#include "map/shell_settings.hpp"
#include "qjulia/map/orbit_settings.hpp"

namespace qjulia {

using fitting::kLeastFactors, fitting::kMostFactors, fitting::kMostChosenFactors;

namespace {

/// How large the map is, and how wild.
std::vector<FitSetting> map_settings() {
  return {
      {{{.name = "factors",
         .values = "NUMBER|auto",
         .least = kLeastFactors,
         .most = kMostFactors,
         .automatic = "auto",
         .example = "9",
         .help = "Factors of the map, 8 to 20000, or 'auto': as many as settle in the time limit "
                 "on this device, or as the schedule says where there is none. More follow the "
                 "shape more closely; the fit, surfaces and pictures take longer"},
        [](FitOptions& o) -> ValuePlace { return &o.factors; }}},
      {{{.name = "max_factors",
         .values = "INT",
         .least = kLeastFactors,
         .most = kMostFactors,
         .left_out = fmt::format("{}", kMostChosenFactors),
         .example = "8",
         .help = "The largest number that 'auto' stands for, 8 to 20000"},
        [](FitOptions& o) -> ValuePlace { return &o.max_factors; }}},
      {{map::detail_setting(), [](FitOptions& o) -> ValuePlace { return &o.detail; }}},
      {{map::steepness_setting(), [](FitOptions& o) -> ValuePlace { return &o.steepness; }}, true},
      {{map::up_setting(), [](FitOptions& o) -> ValuePlace { return &o.up; }}, true},
  };
}

/// When the fit ends.
std::vector<FitSetting> ending_settings() {
  return {
      {{{.name = "time_limit",
         .values = "SECONDS",
         .unit = "seconds",
         .least = Setting::kAboveZero,
         .may_be_infinite = true,
         .left_out = "none",
         .example = "1000",
         .help = "Seconds of the whole fit; the map reached by then is kept"},
        [](FitOptions& o) -> ValuePlace { return &o.time_limit; }},
       true},
      {{{.name = "target_iou",
         .values = "NUMBER",
         .least = Setting::kAboveZero,
         .most = 1,
         .left_out = "none",
         .example = "0.999",
         .help = "End after the first stage whose map has this IoU or more on a grid of 48 cells a "
                 "side; above 0, at most 1"},
        [](FitOptions& o) -> ValuePlace { return &o.target_iou; }},
       true},
      {{{.name = "max_evaluations",
         .values = "INT",
         .least = 1,
         .left_out = "the schedule's",
         .example = "2",
         .help = "The most evaluations of energy and gradient"},
        [](FitOptions& o) -> ValuePlace { return &o.max_evaluations; }}},
  };
}

/// What the fit does.
std::vector<FitSetting> course_settings() {
  Setting precision = precision_setting();
  precision.help = "Arithmetic on the device";
  return {
      {{{.name = "seed",
         .values = "INT",
         .least = 0,
         .example = "7",
         .help =
             "Seed of all random choices. The same seed, options and device give the same "
             "factors bit for bit, unless a time limit ends the fit or the device's settings were "
             "tuned in between",
         .interpolation = Interpolation::none},
        [](FitOptions& o) -> ValuePlace { return &o.seed; }}},
      {{{.name = "schedule",
         .values = "TEXT",
         .example = "fast",
         .help = "What the fit does, level by level: 'tight', 'fast' (shorter, coarser), 'paper' "
                 "(the course of Kim 2015), 'follow' (short, for a map to start from), or a .toml "
                 "file of "
                 "levels",
         .interpolation = Interpolation::none},
        [](FitOptions& o) -> ValuePlace { return &o.schedule; }},
       true},  // a checkpoint has its text, whatever the name
      {{{.name = "polish",
         .example = "",
         .help = "Spend the last two fifths of the fit on the iterated set itself, at the wanted "
                 "detail: closer to the shape, and less rough",
         .interpolation = Interpolation::none},
        [](FitOptions& o) -> ValuePlace { return &o.polish; }}},
      {{{.name = "unknowns",
         .words = {"exponents", "all"},
         .example = "exponents",
         .help = "What the fit may change: exponents alone, or exponents and centres",
         .interpolation = Interpolation::none},
        [](FitOptions& o) -> ValuePlace { return WordPlace(o.unknowns); }}},
      {{{.name = "placement",
         .words = {"depth", "paper"},
         .example = "paper",
         .help = "Where factors start: 'depth' spreads them inside and about the shape, 'paper' "
                 "puts them on the surface as point charges (Kim 2015)",
         .interpolation = Interpolation::none},
        [](FitOptions& o) -> ValuePlace { return WordPlace(o.placement); }}},
      {{{.name = "sample_parts",
         .values = "INT",
         .least = 1,
         .most = 1024,
         .left_out = "the number of ranks",
         .example = "2",
         .help = "Equal parts of the samples over which energies are summed; under mpirun, ranks "
                 "share them. The same number gives the same factors bit for bit on any number of "
                 "ranks"},
        [](FitOptions& o) -> ValuePlace { return &o.sample_parts; }}},
      {{std::move(precision), [](FitOptions& o) -> ValuePlace { return WordPlace(o.precision); }}},
  };
}

}  // namespace

std::span<const FitSetting> fit_settings() {
  static const std::vector<FitSetting> all = [] {
    std::vector<FitSetting> made;
    for (const auto part : {map_settings, ending_settings, course_settings}) {
      std::ranges::move(part(), std::back_inserter(made));
    }
    return made;
  }();
  return all;
}

const FitSetting& fit_setting_named(std::string_view name) {
  return setting_named(fit_settings(), name, "fits");
}

}  // namespace qjulia
