#include "qjulia/surface/print_settings.hpp"

#include <vector>

namespace qjulia {
namespace {

constexpr double kShortest = 1e-6, kLongest = 1e9;

/// A length that may be left out.
Setting length(const char* name, const char* example, const char* help) {
  return {.name = name,
          .values = "LENGTH",
          .least = kShortest,
          .most = kLongest,
          .example = example,
          .help = help};
}

}  // namespace

std::span<const SettingOf<PrintOptions>> print_settings() {
  static const std::vector<SettingOf<PrintOptions>> all{
      {length("height", "40", "Scale the mesh to this height along its up axis, in millimetres"),
       [](PrintOptions& o) -> ValuePlace { return &o.height; }},
      {length("longest", "40",
              "Scale the mesh so that the longest side of its box has this length, in millimetres"),
       [](PrintOptions& o) -> ValuePlace { return &o.longest; }},
      {{.name = "max_triangles",
        .values = "INT",
        .least = 4,
        .example = "400",
        .help = "Decimate the mesh to at most this number of triangles, edge by edge, the flattest "
                "places first"},
       [](PrintOptions& o) -> ValuePlace { return &o.max_triangles; }},
      {length(
           "max_error", "1",
           "Decimate the mesh as long as the result and the mesh stay within this distance of "
           "each other, in millimetres if the mesh has a size in millimetres, else in the "
           "shape's units; with `max_triangles`, until the first of the two limits is reached. "
           "The summary says which one ended it, and the farthest distance that was measured, at "
           "25 points of each triangle; between them about one point in a hundred thousand lies up "
           "to 15 % farther than this distance"),
       [](PrintOptions& o) -> ValuePlace { return &o.max_error; }},
      {length("min_wall", "1",
              "Thicken walls that are thinner than this, until at most a hundredth of the surface "
              "has thinner ones. This rounds edges"),
       [](PrintOptions& o) -> ValuePlace { return &o.min_wall; }},
      {length("flat_foot", "1",
              "Cut this length off the lower end, flat, so that the print stands"),
       [](PrintOptions& o) -> ValuePlace { return &o.flat_foot; }},
      {length("shell", "4", "Hollow the mesh out, with a wall of this thickness, and drain it"),
       [](PrintOptions& o) -> ValuePlace { return &o.shell; }},
      {{.name = "drain",
        .values = "LENGTH",
        .least = 0,
        .most = kLongest,
        .example = "2",
        .help = "Diameter of the hole from the cavity's lowest place straight down; 0 for none"},
       [](PrintOptions& o) -> ValuePlace { return &o.drain; }},
  };
  return all;
}

}  // namespace qjulia
