#include "qjulia/surface/compare_settings.hpp"

#include <vector>

#include "qjulia/map/orbit_settings.hpp"

namespace qjulia {
namespace {

std::vector<SettingOf<CompareOptions>> own_comparison_settings() {
  constexpr int kMostComparedCells = 1024;
  return {
      {{.name = "resolution",
        .values = "INT",
        .unit = "cells",
        .least = 8,
        .most = kMostComparedCells,
        .example = "16",
        .help = "Cells along each side of the cube"},
       [](CompareOptions& o) -> ValuePlace { return &o.resolution; }},
      {{.name = "limbs",
        .example = "",
        .help = "Also count the mesh's limbs (arms, legs, ears; a tenth of its longest side and "
                "more), and those that the set keeps to the last quarter of their length"},
       [](CompareOptions& o) -> ValuePlace { return &o.limbs; }},
  };
}

}  // namespace

std::span<const SettingOf<CompareOptions>> compare_settings() {
  static const std::vector<SettingOf<CompareOptions>> all = [] {
    std::vector<SettingOf<CompareOptions>> made = own_comparison_settings();
    for (auto& setting : orbit_settings<CompareOptions>()) {
      if (setting.name == "box") {
        setting.help = "Part of space to which the comparison is limited, shape units";
        setting.left_out = "a cube about the mesh";
      }
      made.push_back(setting);
    }
    return made;
  }();
  return all;
}

}  // namespace qjulia
