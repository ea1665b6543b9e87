#include "qjulia/map/orbit_settings.hpp"

#include "map/checks.hpp"
#include "qjulia/map/field.hpp"

namespace qjulia {

Setting iterations_setting() {
  return {.name = "iterations",
          .values = "INT",
          .least = 1,
          .most = kMostIterations,
          .example = "3",
          .help =
              "Iterations n, 1 to 16: 1 is the fitted shape itself, 2 and 3 have fewer octaves "
              "of detail, 6 is the set as it stays (8 where the detail is above 0.03)",
          .interpolation = Interpolation::none};
}

Setting box_setting() {
  return {.name = "box",
          .values = "X0 Y0 Z0 X1 Y1 Z1",
          .unit = "shape units",
          .example = "-3 -3 -3 3 3 3",
          .help = "Part of space to look at, shape units"};
}

Setting escape_setting() {
  return {.name = "escape",
          .values = "R",
          .unit = "map units",
          .least = Setting::kAboveZero,
          .most = kLargestEscape,
          .left_out = "farther than any orbit returns from",
          .example = "60",
          .help =
              "Radius, map units, beyond which an orbit ends as outside: a radius smaller than "
              "the set's own cuts into it"};
}

Setting precision_setting() {
  return {.name = "precision",
          .words = {"single", "double"},
          .example = "double",
          .help = "Arithmetic of the orbits: single, or double where the device has it",
          .interpolation = Interpolation::none};
}

}  // namespace qjulia
