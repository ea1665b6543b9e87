#include "qjulia/picture/picture_settings.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <utility>

#include "qjulia/map/orbit_settings.hpp"
#include "qjulia/picture/look.hpp"
#include "qjulia/picture/materials.hpp"

namespace qjulia {
namespace {

std::vector<std::string> material_words() {
  std::vector<std::string> words;
  for (const MaterialFacts& facts : materials()) words.emplace_back(facts.word);
  return words;
}

/// What is drawn of the set.
std::vector<PictureSetting> field_settings() {
  std::vector<PictureSetting> made;
  for (auto& setting : orbit_settings<PictureOptions>()) {
    if (setting.name == "iterations") {
      setting.group = "Fractal";
      setting.controls = {{.name = "iterations",
                           .label = "iterations",
                           .help = "",
                           .least = setting.least,
                           .most = setting.most,
                           .step = 1,
                           .is_whole = true}};
    }
    if (setting.name == "box") {
      setting.help = "Part of space to look at, shape units; the set is cut open at its faces";
      setting.left_out = "the whole set";
    }
    made.push_back({setting});
  }
  made.push_back({{{.name = "cut",
                    .values = "AXIS=PLACE",
                    .example = "z=90%",
                    .help = "Cut away what lies beyond a place along an axis, and show the inside: "
                            "a coordinate, shape units, or per cent of the shape's box; several "
                            "with commas, x=0.2,z=50%",
                    .interpolation = Interpolation::none},
                   [](PictureOptions& p) -> ValuePlace { return &p.cuts; }}});
  made.push_back(
      {{{.name = "keep_loose",
         .example = "",
         .help = "Draw all connected parts of the set. Default: parts less than a hundredth as "
                 "large as the largest are left out, as 'qjulia surface' does",
         .interpolation = Interpolation::none},
        [](PictureOptions& p) -> ValuePlace { return &p.keep_loose; }}});
  made.push_back(
      {{{.name = "exact",
         .example = "",
         .help = "Compute every orbit, instead of looking iterates up in tables where that moves "
                 "what is seen by no more than about an eighth of a pixel: up to three times "
                 "slower for maps of many factors",
         .interpolation = Interpolation::none},
        [](PictureOptions& p) -> ValuePlace { return &p.exact; }}});
  return made;
}

/// The pixels.
std::vector<PictureSetting> pixel_settings() {
  constexpr int kMostSamples = 8;
  return {
      {{{.name = "size",
         .values = "WxH",
         .unit = "pixels",
         .example = "16x12",
         .help = "Width and height in pixels",
         .interpolation = Interpolation::none},
        [](PictureOptions& p) -> ValuePlace {
          return SizePlace{&p.width, &p.height};
        }}},
      {{{.name = "samples",
         .values = "INT",
         .least = 1,
         .most = kMostSamples,
         .example = "1",
         .help = "Anti-aliasing: N x N rays per pixel",
         .interpolation = Interpolation::none},
        [](PictureOptions& p) -> ValuePlace { return &p.samples; }}},
      {{{.name = "bits",
         .values = "8|16",
         .least = 8,
         .most = 16,
         .example = "16",
         .help =
             "Bits of each of a pixel's colours: 8, or 16, which can be made brighter or darker "
             "without steps",
         .interpolation = Interpolation::none},
        [](PictureOptions& p) -> ValuePlace { return &p.bits; }}},
  };
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
         .least = 0,
         .most = 120,
         .example = "40",
         .help = "Degrees, vertical, 1 to 120; 0 draws with parallel rays (orthographic), as large "
                 "as at 30"},
        [](PictureOptions& p) -> ValuePlace { return &p.camera.field_of_view; }},
       true},
      {{{.name = "aperture",
         .values = "NUMBER",
         .least = 0,
         .most = 1,
         .example = "0.1",
         .help = "The width of the lens, as a share of its distance to what is in focus. What lies "
                 "as far behind that as the picture is high is blurred to about this share of the "
                 "picture's height. 0 is sharp everywhere; otherwise a pixel has 16 times as many "
                 "rays, and a close-up takes minutes"},
        [](PictureOptions& p) -> ValuePlace { return &p.camera.aperture; }},
       true},
      {{{.name = "focus",
         .values = "X Y Z",
         .unit = "shape units",
         .left_out = "what is seen in the middle of the picture, or else nearest to it",
         .example = "0 0.1 0",
         .help = "The point that is in focus, shape units"},
        [](PictureOptions& p) -> ValuePlace { return &p.camera.focus; }},
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

/// Colours, lamps and the exposure.
std::vector<PictureSetting> light_settings() {
  return {
      {{{.name = "look",
         .values = "NAME|FILE.toml",
         .example = "gold",
         .help = fmt::format("Settings that go together: {}; or a file of your own. Other options "
                             "override it",
                             fmt::join(look_names(), ", ")),
         .interpolation = Interpolation::none,
         .group = "Look",
         .controls = {{.name = "wears",
                       .label = "look",
                       .help = "Light, matter and colours that go together; what is set below "
                               "overrides it",
                       .words = look_names(),
                       .needs_server = true}}},
        [](PictureOptions& p) -> ValuePlace { return &p.look; }}},
      {{{.name = "material",
         .words = material_words(),
         .example = "groove",
         .help = "What colours the set: clay; " + materials_help(),
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
      {{{.name = "range",
         .values = "LOW,...,HIGH",
         .left_out = "the palette is spread so that each part of it is seen about as much as any "
                     "other; a series of pictures is treated as one",
         .example = "0,0.2,0.5,1",
         .help = "The values of `material` at which the palette begins and ends, and between "
                 "these the values that divide it into equal parts; without any it is spread "
                 "evenly. The note in a picture holds its range; give it again to keep the "
                 "colours in other pictures, maps and meshes",
         .interpolation = Interpolation::none},
        [](PictureOptions& p) -> ValuePlace { return &p.range; }}},
      {{{.name = "ground",
         .example = "",
         .help = "The ground under the set, with its shadow",
         .interpolation = Interpolation::none},
        [](PictureOptions& p) -> ValuePlace { return &p.ground; }}},
      {{{.name = "background",
         .values = "studio|transparent|environment|COLOUR",
         .example = "203040",
         .help = "What is behind the set: studio, a light grey wall in the light of the lamps; "
                 "transparent, with an alpha, in which the set's shadow is black and lets what is "
                 "behind shine through; environment, what `environment` shows there; or a colour, "
                 "RRGGBB "
                 "(sRGB), white or black",
         .interpolation = Interpolation::none},
        [](PictureOptions& p) -> ValuePlace { return &p.background; }}},
      {{{.name = "light",
         .words = {"studio", "rim", "low-key", "noon", "dusk", "museum"},
         .example = "rim",
         .help = "Lamps and a sky that go together: studio, even and soft; rim, two lamps from "
                 "behind that draw the outline; low-key, one lamp from the side in the dark; noon, "
                 "a high sun and a blue sky; dusk, the last sun; museum, warm spots from above",
         .interpolation = Interpolation::none},
        [](PictureOptions& p) -> ValuePlace { return WordPlace(p.light.rig); }}},
      {{{.name = "lamp",
         .values = "AZIMUTH,ELEVATION,STRENGTH[,COLOUR[,SIZE]]",
         .left_out = "those of `light`",
         .example = "10,20,1.5,3200K,5",
         .help =
             "A lamp. The first one given replaces the first of `light`, the second the second, "
             "up to 8. AZIMUTH is degrees to the right of the camera; ELEVATION is degrees "
             "above the horizon; STRENGTH is 0 to 100, and 0 leaves the lamp out. COLOUR is a "
             "temperature such as 3200K (6500K is white) or RRGGBB. SIZE is degrees from the "
             "lamp's middle to its edge, 0 to 60; a large lamp casts soft shadows",
         .interpolation = Interpolation::none,
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
                       .label = "strength",
                       .help = "Strength of the lamp",
                       .least = 0,
                       .most = 2,
                       .step = 0.05}}},
        [](PictureOptions& p) -> ValuePlace { return &p.light.lamps; }}},
      {{{.name = "lamp_turn",
         .values = "DEGREES",
         .unit = "degrees",
         .left_out = "the camera's `azimuth`, so that the set turns under the lamps",
         .example = "90",
         .help =
             "Where AZIMUTH of `lamp` and the lamps of `light` count from, degrees about the "
             "up axis as `azimuth` turns the camera. With it, lamps and shadows stay where they "
             "are while the camera goes around"},
        [](PictureOptions& p) -> ValuePlace { return &p.light.lamp_turn; }}},
      {{{.name = "fill",
         .values = "NUMBER",
         .least = 0,
         .most = 10,
         .left_out = "that of `light`",
         .example = "0.3",
         .help = "How strong the light is that comes from all sides; 1 is that of the studio"},
        [](PictureOptions& p) -> ValuePlace { return &p.light.fill; }}},
      {{{.name = "fill_color",
         .values = "COLOUR",
         .left_out = "that of `light`",
         .example = "9000K",
         .help = "The colour of the light from all sides: a temperature such as 9000K (6500K is "
                 "white) or RRGGBB",
         .interpolation = Interpolation::none},
        [](PictureOptions& p) -> ValuePlace { return &p.light.fill_color; }}},
      {{{.name = "environment",
         .values = "NAME|FILE",
         .left_out = "none",
         .example = "evening",
         .help = fmt::format(
             "What is around the set: {}; or a panorama, .hdr or .exr, twice as wide as high. It "
             "lights the set in place of `light`, is seen in reflections, and where `background` "
             "says so behind the set. `fill` and `fill_color` multiply its light; lamps are those "
             "of `lamp` alone",
             fmt::join(environment_names(), ", ")),
         .interpolation = Interpolation::none,
         .group = "Look",
         .controls = {{.name = "environment",
                       .label = "environment",
                       .help =
                           "What is around the set: it lights the set in place of the lamps, and "
                           "is seen in reflections",
                       .words = environment_names(),
                       .needs_server = true}}},
        [](PictureOptions& p) -> ValuePlace { return &p.light.environment; }}},
      {{{.name = "environment_turn",
         .values = "DEGREES",
         .unit = "degrees",
         .example = "90",
         .help = "Degrees that `environment` is turned about the up axis, as `azimuth` turns the "
                 "camera",
         .group = "Look",
         .controls = {{.name = "environturn",
                       .label = "its turn",
                       .help = "Degrees that the environment is turned about the up axis",
                       .least = -180,
                       .most = 180,
                       .step = 1,
                       .needs_server = true}}},
        [](PictureOptions& p) -> ValuePlace { return &p.light.environment_turn; }}},
      {{{.name = "bounce",
         .values = "NUMBER",
         .least = 0,
         .most = 10,
         .example = "1",
         .help =
             "How strongly the set lights itself with what it gets of the lamps' light, so that "
             "grooves glow in its colour: 1 is as in nature, after one reflection",
         .group = "Look",
         .controls = {{.name = "bounce",
                       .label = "bounce",
                       .help = "",
                       .least = 0,
                       .most = 2,
                       .step = 0.05,
                       .needs_server = true}}},
        [](PictureOptions& p) -> ValuePlace { return &p.light.bounce; }}},
      {{{.name = "exposure",
         .values = "STOPS",
         .least = -20,
         .most = 20,
         .automatic = "auto",
         .example = "0.5",
         .help =
             "Stops: each doubles the light of the picture. auto gives the set as much light as "
             "the studio does; all pictures of a series have the same"},
        [](PictureOptions& p) -> ValuePlace { return &p.exposure; }}},
      {{{.name = "tone",
         .words = {"neutral", "agx", "aces", "none"},
         .example = "agx",
         .help = "How bright light becomes colour: neutral keeps colours as they are (Khronos PBR "
                 "Neutral); agx lets bright ones fade slowly to white; aces has much "
                 "contrast; none cuts off",
         .interpolation = Interpolation::none},
        [](PictureOptions& p) -> ValuePlace { return WordPlace(p.tone); }}},
  };
}

/// A setting of matter, a number.
PictureSetting of_matter(Setting setting, ValuePlace (*place)(PictureOptions&)) {
  setting.values = "NUMBER";
  return {{std::move(setting), place}};
}

/// What the set is made of.
std::vector<PictureSetting> matter_settings() {
  return {
      of_matter({.name = "roughness",
                 .least = 0,
                 .most = 1,
                 .example = "0.3",
                 .help = "0 is polished, 1 is chalk"},
                [](PictureOptions& p) -> ValuePlace { return &p.matter.roughness; }),
      of_matter({.name = "metal",
                 .least = 0,
                 .most = 1,
                 .example = "1",
                 .help = "1 is metal, which reflects its surroundings in its own colour"},
                [](PictureOptions& p) -> ValuePlace { return &p.matter.metal; }),
      of_matter({.name = "coat",
                 .least = 0,
                 .most = 1,
                 .example = "0.8",
                 .help = "How much of a clear, polished layer lies over the set"},
                [](PictureOptions& p) -> ValuePlace { return &p.matter.coat; }),
      of_matter({.name = "sheen",
                 .least = 0,
                 .most = 1,
                 .example = "0.5",
                 .help = "How bright edges are, as those of velvet"},
                [](PictureOptions& p) -> ValuePlace { return &p.matter.sheen; }),
      of_matter({.name = "wax",
                 .least = 0,
                 .most = 1,
                 .example = "0.7",
                 .help = "How much light goes through what is thin, as through wax or jade"},
                [](PictureOptions& p) -> ValuePlace { return &p.matter.wax; }),
      of_matter(
          {.name = "glow",
           .least = 0,
           .most = 10,
           .example = "2",
           .help = "How strongly a part of the palette shines by itself, the upper one unless "
                   "`glow_full` says otherwise"},
          [](PictureOptions& p) -> ValuePlace { return &p.matter.glow; }),
      of_matter({.name = "glow_from",
                 .least = 0,
                 .most = 1,
                 .example = "0.9",
                 .help = "Where on the palette the glow begins, 0 to 1"},
                [](PictureOptions& p) -> ValuePlace { return &p.matter.glow_from; }),
      of_matter({.name = "glow_full",
                 .least = 0,
                 .most = 1,
                 .example = "0.95",
                 .help = "Where on the palette the glow is strongest. Below `glow_from`, the lower "
                         "part of the palette glows"},
                [](PictureOptions& p) -> ValuePlace { return &p.matter.glow_full; }),
      of_matter({.name = "fog",
                 .least = 0,
                 .most = 1,
                 .example = "0.4",
                 .help = "How strongly the set's far side fades into the background"},
                [](PictureOptions& p) -> ValuePlace { return &p.matter.fog; }),
  };
}

std::vector<PictureSetting> made_settings() {
  std::vector<PictureSetting> all;
  for (const auto part :
       {field_settings, pixel_settings, camera_place_settings, camera_frame_settings}) {
    std::ranges::move(part(), std::back_inserter(all));
  }
  // "look" is for records alone, and the material's values are found with the set's grids.
  constexpr std::array kOfSet{"look", "material"};
  constexpr std::array kOfSky{"light", "fill", "fill_color", "environment", "environment_turn",
                              "ground"};
  const auto is_one_of = [](const auto& names, const std::string& name) {
    return std::ranges::find(names, name) != names.end();
  };
  for (const auto part : {light_settings, matter_settings}) {
    for (PictureSetting& setting : part()) {
      setting.is_of_look = setting.name != "look";
      setting.remade = is_one_of(kOfSet, setting.name)   ? Remade::set
                       : is_one_of(kOfSky, setting.name) ? Remade::sky
                                                         : Remade::nothing;
      all.push_back(std::move(setting));
    }
  }
  return all;
}

}  // namespace

std::span<const PictureSetting> picture_settings() {
  static const std::vector<PictureSetting> all = made_settings();
  return all;
}

const PictureSetting& picture_setting_named(std::string_view name) {
  return setting_named(picture_settings(), name, "pictures");
}

}  // namespace qjulia
