#include "qjulia/picture_settings.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "qjulia/orbit_settings.hpp"

namespace qjulia {
namespace {

/// What is drawn of the set.
std::vector<PictureSetting> field_settings() {
  Setting iterations = iterations_setting();
  iterations.group = "Fractal";
  iterations.controls = {{.name = "iterations",
                          .label = "iterations",
                          .help = "",
                          .least = iterations.least,
                          .most = iterations.most,
                          .step = 1,
                          .is_whole = true}};
  return {{{std::move(iterations), [](PictureOptions& p) -> ValuePlace { return &p.iterations; }}}};
}

/// Where the camera is.
std::vector<PictureSetting> camera_place_settings() {
  return {
      {{{.name = "azimuth",
         .values = "NUMBER",
         .unit = "degrees",
         .example = "40",
         .help = "Degrees the camera is turned about the up axis",
         .controls = {{.name = "azimuth",
                       .label = "azimuth",
                       .help = "",
                       .least = -180,
                       .most = 180,
                       .step = 1}}},
        [](PictureOptions& p) -> ValuePlace { return &p.camera.azimuth; }},
       true},
      {{{.name = "elevation",
         .values = "NUMBER",
         .unit = "degrees",
         .least = -90,
         .most = 90,
         .example = "20",
         .help = "Degrees of the camera above the horizon",
         .controls = {{.name = "elevation",
                       .label = "elevation",
                       .help = "",
                       .least = -90,
                       .most = 90,
                       .step = 1}}},
        [](PictureOptions& p) -> ValuePlace { return &p.camera.elevation; }},
       true},
      {{{.name = "zoom",
         .values = "NUMBER",
         .least = 0.01,
         .most = 1000,
         .example = "1.25",
         .help = "1 shows the whole set, 2 half of it",
         .interpolation = Interpolation::logarithmic,
         .controls = {{.name = "zoom",
                       .label = "zoom",
                       .help = "",
                       .least = 0.1,
                       .most = 500,
                       .step = 0,
                       .is_logarithmic = true}}},
        [](PictureOptions& p) -> ValuePlace { return &p.camera.zoom; }},
       true},
  };
}

/// What the camera frames.
std::vector<PictureSetting> camera_frame_settings() {
  return {
      {{{.name = "look_at",
         .values = "X Y Z",
         .unit = "shape units",
         .left_out = "the middle of frame, or else the point that puts the set in the middle; all "
                     "pictures of a series have the same",
         .example = "0 0.1 0",
         .help = "The point in the middle of the picture, shape units",
         .controls = {{.name = "look", .label = "look at", .help = ""}}},
        [](PictureOptions& p) -> ValuePlace { return &p.camera.look_at; }},
       true},
      {{{.name = "distance",
         .values = "NUMBER",
         .unit = "shape units",
         .least = Setting::kAboveZero,
         .left_out = "a set in the middle fills 83 % of the picture's tighter side; all pictures "
                     "of a series have the same",
         .example = "9",
         .help = "Distance from the eye to the point in the middle of the picture, shape units",
         .controls = {{.name = "distance", .label = "distance", .help = ""}}},
        [](PictureOptions& p) -> ValuePlace { return &p.camera.distance; }},
       true},
      {{{.name = "frame",
         .values = "X0 Y0 Z0 X1 Y1 Z1",
         .unit = "shape units",
         .left_out = "the whole set",
         .example = "-1.5 -1.5 -1.5 1.5 1.5 1.5",
         .help = "The box that fills the picture at zoom 1, shape units, seen from the distance "
                 "that shows the whole set"},
        [](PictureOptions& p) -> ValuePlace { return &p.camera.frame; }},
       true},
      {{{.name = "field_of_view",
         .values = "NUMBER",
         .unit = "degrees",
         .least = 1,
         .most = 120,
         .example = "40",
         .help = "Degrees, vertical"},
        [](PictureOptions& p) -> ValuePlace { return &p.camera.field_of_view; }},
       true},
      {{{.name = "up",
         .values = "x|y|z|-x|-y|-z|auto",
         .automatic = "auto",
         .example = "z",
         .help = "The shape's axis that points up; auto is what the map says, or y where it says "
                 "nothing. Of a mesh it is a guess: its flattest, widest end is down",
         .interpolation = Interpolation::none,
         .group = "Look",
         .controls = {{.name = "up",
                       .label = "up",
                       .help = "The shape's axis that points up",
                       .words = {"x", "y", "z", "-x", "-y", "-z"}}}},
        [](PictureOptions& p) -> ValuePlace { return &p.camera.up; }}},
  };
}

/// Colours and lamps.
std::vector<PictureSetting> light_settings() {
  return {
      {{{.name = "material",
         .words = {"clay", "iterations", "trap", "groove", "height", "factor"},
         .example = "groove",
         .help = "What colours the set: clay; iterations, how long the orbit of a point stays "
                 "undecided; trap, how close two iterates come to the plane X = 0, seen from the "
                 "origin; groove, from the bottoms of grooves to the tips of ridges; "
                 "height, along the up axis; or factor, which factor of the map is nearest, "
                 "poles in the lower half of the palette and roots in the upper",
         .interpolation = Interpolation::none,
         .group = "Look",
         .controls = {{.name = "material", .label = "material", .help = ""}}},
        [](PictureOptions& p) -> ValuePlace { return WordPlace(p.material); }}},
      {{{.name = "palette",
         .values = "NAME|COLOURS",
         .example = "102030,405060",
         .help = "The set's colours: of clay, or those that the other materials go through "
                 "from low "
                 "to high",
         .interpolation = Interpolation::none,
         .group = "Look",
         .controls =
             {{.name = "palette", .label = "palette", .help = "", .words = palette_names()}}},
        [](PictureOptions& p) -> ValuePlace { return &p.palette; }}},
      {{{.name = "lamp",
         .values = "AZIMUTH ELEVATION STRENGTH",
         .example = "10 20 1.5",
         .help = "The brightest light: degrees from the camera to the right, degrees above the "
                 "horizon, and how strong it is, 0 to 10",
         .group = "Look",
         .controls = {{.name = "lightaz",
                       .label = "from the side",
                       .help = "Where the lamp is, degrees from the camera to the right",
                       .least = -180,
                       .most = 180,
                       .step = 1},
                      {.name = "lightup",
                       .label = "from above",
                       .help = "How high the lamp is, degrees",
                       .least = -20,
                       .most = 90,
                       .step = 1},
                      {.name = "light",
                       .label = "light",
                       .help = "Strength of the lamp",
                       .least = 0,
                       .most = 2,
                       .step = 0.05}}},
        [](PictureOptions& p) -> ValuePlace { return &p.lamp; }}},
  };
}

std::vector<PictureSetting> made_settings() {
  std::vector<PictureSetting> all;
  for (const auto part :
       {field_settings, camera_place_settings, camera_frame_settings, light_settings}) {
    std::ranges::move(part(), std::back_inserter(all));
  }
  return all;
}

}  // namespace

const char* to_string(Material material) {
  return picture_setting_named("material").words.at(static_cast<std::size_t>(material)).c_str();
}

const char* to_string(Backdrop backdrop) {
  switch (backdrop) {
    case Backdrop::studio:
      return "studio";
    case Backdrop::plain:
      return "plain";
    case Backdrop::transparent:
      return "transparent";
  }
  return "";
}

std::span<const PictureSetting> picture_settings() {
  static const std::vector<PictureSetting> all = made_settings();
  return all;
}

const PictureSetting& picture_setting_named(std::string_view name) {
  return setting_named(picture_settings(), name, "pictures");
}

}  // namespace qjulia
