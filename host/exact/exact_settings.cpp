#include "qjulia/exact/exact_settings.hpp"

#include <vector>

#include "exact/grid_cells.hpp"
#include "map/shell_settings.hpp"

namespace qjulia {

std::span<const SettingOf<ExactMapOptions>> exact_settings() {
  using exact::kFewestGridCells, exact::kMostGridCells;
  using Options = ExactMapOptions;
  static const std::vector<SettingOf<Options>> all{
      {{.name = "resolution",
        .values = "INT",
        .unit = "cells",
        .least = kFewestGridCells,
        .most = kMostGridCells,
        .example = "32",
        .help = "Cells of the grid along its longest side, 32 to 384: more where limbs are thinner "
                "than two cells"},
       [](Options& o) -> ValuePlace { return &o.resolution; }},
      {map::detail_setting(), [](Options& o) -> ValuePlace { return &o.detail; }},
      {map::steepness_setting(), [](Options& o) -> ValuePlace { return &o.steepness; }},
      {map::up_setting(), [](Options& o) -> ValuePlace { return &o.up; }},
      {{.name = "fourth",
        .words = {"round", "ignored"},
        .example = "ignored",
        .help = "Where the shape ends along the fourth coordinate: round, as thick as it is "
                "elsewhere; or nowhere, which is rougher",
        .interpolation = Interpolation::none},
       [](Options& o) -> ValuePlace { return WordPlace(o.fourth); }},
  };
  return all;
}

}  // namespace qjulia
