#include "qjulia/picture_settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>

#include "qjulia/error.hpp"
#include "qjulia/field.hpp"

namespace qjulia {
namespace {

/// What is drawn of the set.
std::vector<PictureSetting> field_settings() {
  return {
      {{.name = "iterations",
        .values = "INT",
        .unit = "",
        .least = 1,
        .most = kMostIterations,
        .help =
            "Iterations n, 1 to 16: 1 is the fitted shape itself, 2 and 3 have fewer octaves of "
            "detail, 6 is the set as it stays (8 where the detail is above 0.03)",
        .more = "",
        .interpolation = Interpolation::none,
        .group = "Fractal",
        .controls = {{.name = "iterations",
                      .label = "iterations",
                      .help = "",
                      .least = 1,
                      .most = kMostIterations,
                      .step = 1,
                      .is_whole = true}}},
       [](PictureOptions& p) -> int& { return p.iterations; }},
  };
}

/// Where the camera is.
std::vector<PictureSetting> camera_place_settings() {
  return {
      {{.name = "azimuth",
        .values = "NUMBER",
        .unit = "degrees",
        .help = "Degrees the camera is turned about the up axis",
        .more = "",
        .controls = {{.name = "azimuth",
                      .label = "azimuth",
                      .help = "",
                      .least = -180,
                      .most = 180,
                      .step = 1}}},
       [](PictureOptions& p) -> double& { return p.camera.azimuth; },
       true},
      {{.name = "elevation",
        .values = "NUMBER",
        .unit = "degrees",
        .help = "Degrees of the camera above the horizon",
        .more = "",
        .controls = {{.name = "elevation",
                      .label = "elevation",
                      .help = "",
                      .least = -90,
                      .most = 90,
                      .step = 1}}},
       [](PictureOptions& p) -> double& { return p.camera.elevation; },
       true},
      {{.name = "zoom",
        .values = "NUMBER",
        .unit = "",
        .help = "1 shows the whole set, 2 half of it",
        .more = "",
        .interpolation = Interpolation::logarithmic,
        .controls = {{.name = "zoom",
                      .label = "zoom",
                      .help = "",
                      .least = 0.1,
                      .most = 500,
                      .step = 0,
                      .is_logarithmic = true}}},
       [](PictureOptions& p) -> double& { return p.camera.zoom; },
       true},
  };
}

/// What the camera frames.
std::vector<PictureSetting> camera_frame_settings() {
  return {
      {{.name = "look_at",
        .values = "X Y Z",
        .unit = "shape units",
        .help = "The point in the middle of the picture, shape units",
        .more = "By default it is the middle of frame, or else the point that puts the set in the "
                "middle. All pictures of a series have the same.",
        .controls = {{.name = "look", .label = "look at", .help = ""}}},
       [](PictureOptions& p) -> std::optional<Eigen::Vector3d>& { return p.camera.look_at; },
       true},
      {{.name = "distance",
        .values = "NUMBER",
        .unit = "shape units",
        .help = "Distance from the eye to the point in the middle of the picture, shape units",
        .more = "By default, a set in the middle fills 83 % of the picture's tighter side. All "
                "pictures of a series have the same.",
        .controls = {{.name = "distance", .label = "distance", .help = ""}}},
       [](PictureOptions& p) -> std::optional<double>& { return p.camera.distance; },
       true},
      {{.name = "frame",
        .values = "X0 Y0 Z0 X1 Y1 Z1",
        .unit = "shape units",
        .help = "The box that fills the picture at zoom 1, shape units, seen from the distance "
                "that shows the whole set",
        .more = "By default it is the whole set."},
       [](PictureOptions& p) -> std::optional<Box>& { return p.camera.frame; },
       true},
      {{.name = "field_of_view",
        .values = "NUMBER",
        .unit = "degrees",
        .help = "Degrees, vertical",
        .more = ""},
       [](PictureOptions& p) -> double& { return p.camera.field_of_view; },
       true},
      {{.name = "up",
        .values = "x|y|z|-x|-y|-z|auto",
        .unit = "",
        .help = "The shape's axis that points up; auto is what the map says, or y where it says "
                "nothing. Of a mesh it is a guess: its flattest, widest end is down",
        .more = "",
        .interpolation = Interpolation::none,
        .group = "Look",
        .controls = {{.name = "up",
                      .label = "up",
                      .help = "The shape's axis that points up",
                      .words = {"x", "y", "z", "-x", "-y", "-z"}}}},
       [](PictureOptions& p) -> std::optional<UpAxis>& { return p.camera.up; }},
  };
}

/// Colours and lamps.
std::vector<PictureSetting> light_settings() {
  return {
      {{.name = "material",
        .values = "clay|iterations|trap|groove|height|factor",
        .unit = "",
        .help = "What colours the set: clay; iterations, how long the orbit of a point stays "
                "undecided; trap, how close two iterates come to the plane X = 0, seen from the "
                "origin; groove, from the bottoms of grooves to the tips of ridges; "
                "height, along the up axis; or factor, which factor of the map is nearest, "
                "poles in the lower half of the palette and roots in the upper",
        .more = "",
        .interpolation = Interpolation::none,
        .group = "Look",
        .controls = {{.name = "material",
                      .label = "material",
                      .help = "",
                      .words = {"clay", "iterations", "trap", "groove", "height", "factor"}}}},
       [](PictureOptions& p) -> Material& { return p.material; }},
      {{.name = "palette",
        .values = "NAME|COLOURS",
        .unit = "",
        .help = "The set's colours: of clay, or those that the other materials go through from low "
                "to high",
        .more = "",
        .interpolation = Interpolation::none,
        .group = "Look",
        .controls =
            {{.name = "palette", .label = "palette", .help = "", .words = palette_names()}}},
       [](PictureOptions& p) -> Palette& { return p.palette; }},
      {{.name = "lamp",
        .values = "AZIMUTH ELEVATION STRENGTH",
        .unit = "",
        .help = "The brightest light: degrees from the camera to the right, degrees above the "
                "horizon, and how strong it is, 0 to 10",
        .more = "",
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
       [](PictureOptions& p) -> Lamp& { return p.lamp; }},
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
  switch (material) {
    case Material::clay:
      return "clay";
    case Material::iterations:
      return "iterations";
    case Material::trap:
      return "trap";
    case Material::groove:
      return "groove";
    case Material::height:
      return "height";
    case Material::factor:
      return "factor";
  }
  return "";
}

std::span<const Material> materials() {
  static constexpr std::array kAll{Material::clay,   Material::iterations, Material::trap,
                                   Material::groove, Material::height,     Material::factor};
  return kAll;
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
  const auto found = std::ranges::find(picture_settings(), name, &PictureSetting::name);
  if (found == picture_settings().end()) {
    throw InputError(fmt::format("there is no setting '{}' of pictures", name));
  }
  return *found;
}

std::optional<Material> material_named(std::string_view name) {
  for (const Material material : materials()) {
    if (name == to_string(material)) return material;
  }
  return std::nullopt;
}

}  // namespace qjulia
