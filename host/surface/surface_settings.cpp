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
      {{.name = "exact",
        .example = "",
        .help = "Compute every orbit. By default the sides of grid points are looked up in tables "
                "where that takes less time, as it does at 350 cells and more for maps of 1,000 "
                "factors: at 512 cells in two thirds of the time. Tips of tufts that are as thin "
                "as a cell may then come or go"},
       [](SurfaceOptions& o) -> ValuePlace { return &o.exact; }},
      {{.name = "dense",
        .example = "",
        .help = "Run the orbit of every point of the grid to its end: the same mesh as with "
                "`exact`, much slower, without trusting r_in, r_out and bounds"},
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
