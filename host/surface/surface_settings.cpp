#include "qjulia/surface/surface_settings.hpp"

#include <vector>

#include "qjulia/map/orbit_settings.hpp"

namespace qjulia {
namespace {

constexpr int kMostSurfaceCells = 8192;
constexpr int kMostTriesAnEdge = 20;

std::vector<SettingOf<SurfaceOptions>> own_surface_settings() {
  return {
      {{.name = "resolution",
        .values = "INT",
        .unit = "cells",
        .least = 2,
        .most = kMostSurfaceCells,
        .example = "16",
        .help = "Cells along the box's longest side"},
       [](SurfaceOptions& o) -> ValuePlace { return &o.resolution; }},
      {{.name = "refine",
        .values = "INT",
        .unit = "points",
        .least = 0,
        .most = kMostTriesAnEdge,
        .left_out = "2, or 0 where `iterations` is 1, because that field is smooth",
        .example = "4",
        .help = "How many points to try, 0 to 20, on each grid edge that the surface crosses, to "
                "put its vertex where the set ends. With 0 vertices are interpolated, which leaves "
                "terraces if the field jumps"},
       [](SurfaceOptions& o) -> ValuePlace { return &o.refine; }},
      {{.name = "draft",
        .example = "",
        .help = "Look orbits up in tables instead of computing them: about twice as fast "
                "for maps of 1,000 factors. On three maps at 256 cells, 88 to 98 % of the vertices "
                "lay within a quarter of a cell of the default mesh, and the farthest 3 to 6 cells "
                "away: tips of tufts come and go"},
       [](SurfaceOptions& o) -> ValuePlace { return &o.draft; }},
      {{.name = "dense",
        .example = "",
        .help = "Run the orbit of every point of the grid to its end: the same mesh, much slower, "
                "without trusting r_in, r_out and bounds"},
       [](SurfaceOptions& o) -> ValuePlace { return &o.dense; }},
  };
}

}  // namespace

std::span<const SettingOf<SurfaceOptions>> surface_settings() {
  static const std::vector<SettingOf<SurfaceOptions>> all = [] {
    std::vector<SettingOf<SurfaceOptions>> made = own_surface_settings();
    for (auto& setting : orbit_settings<SurfaceOptions>()) {
      if (setting.name == "box") {
        setting.left_out = "the shape's box plus 5 %, grown until the set fits in";
      }
      made.push_back(setting);
    }
    return made;
  }();
  return all;
}

}  // namespace qjulia
