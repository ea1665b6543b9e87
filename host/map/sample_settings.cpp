#include "qjulia/map/sample_settings.hpp"

#include <vector>

#include "map/checks.hpp"
#include "qjulia/map/orbit_settings.hpp"

namespace qjulia {

std::span<const SettingOf<SampleOptions>> sample_settings() {
  static const std::vector<SettingOf<SampleOptions>> all = [] {
    std::vector<SettingOf<SampleOptions>> made = orbit_settings<SampleOptions>();
    for (auto& setting : made) {
      if (setting.name == "box") setting.left_out = "the shape's box plus 5 %";
      if (setting.name == "escape") {
        setting.left_out = "20, or more where the set or a portal reaches farther";
      }
    }
    made.push_back({{.name = "resolution",
                     .values = "INT",
                     .unit = "cells",
                     .least = 1,
                     .most = map::kMostSampleCells,
                     .example = "8",
                     .help = "Cells along the box's longest side"},
                    [](SampleOptions& o) -> ValuePlace { return &o.resolution; }});
    return made;
  }();
  return all;
}

}  // namespace qjulia
