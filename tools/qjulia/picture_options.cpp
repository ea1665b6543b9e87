#include "picture_options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>

#include "base/text.hpp"
#include "options.hpp"
#include "qjulia/error.hpp"

namespace qjulia::tools {
namespace {

constexpr const char* kLookGroup = "Look of the picture";
constexpr const char* kColorWords = "RRGGBB (sRGB, such as ff8000), white or black";

/// "1280x960" as width and height. @throws InputError
std::array<int, 2> parse_size(const std::string& text) {
  if (const auto words = base::split(text, 'x'); words.size() == 2) {
    const std::array size{base::number_in<int>(words[0]).value_or(0),
                          base::number_in<int>(words[1]).value_or(0)};
    if (size[0] > 0 && size[1] > 0) return size;
  }
  throw InputError(fmt::format("'{}' is not WIDTHxHEIGHT in pixels, such as 1280x960", text));
}

Rgb color_of(const std::string& option, const std::string& word, const std::string& others) {
  const auto found = color_named(word);
  if (!found) {
    throw InputError(
        fmt::format("{}: '{}' is no colour; give {}, or {}", option, word, kColorWords, others));
  }
  return *found;
}

/// A palette by name, or of the colours given: one for clay, several for other materials.
Palette palette_of(const std::string& text, Material material) {
  if (const auto named = palette_named(text)) return *named;
  std::vector<Rgb> colors;
  for (const std::string& word : base::split(text, ',')) {
    colors.push_back(color_of("--palette", word,
                              fmt::format("a palette: {}", fmt::join(palette_names(), ", "))));
  }
  const bool is_clay = material == Material::clay;
  if (is_clay && colors.size() > 1) {
    throw InputError(fmt::format(
        "--palette: clay has one colour, and {} are given; give one, or --material iterations or "
        "trap",
        colors.size()));
  }
  if (!is_clay && (colors.size() < 2 || colors.size() > Palette::kMostStops)) {
    throw InputError(
        fmt::format("--palette: {} given; --material {} goes through 2 to {} colours, such as "
                    "14281d,8a9a5b,e9e4c9",
                    colors.size(), to_string(material), Palette::kMostStops));
  }
  Palette palette;
  if (is_clay) {
    palette.clay = colors.front();
  } else {
    palette.stops = std::move(colors);
  }
  return palette;
}

}  // namespace

Option add_size(Command command, PictureOptions& options) {
  const auto set_size = [&options](const std::string& text) {
    const auto [width, height] = parse_size(text);
    options.width = width;
    options.height = height;
  };
  return command.word("--size", "WxH", set_size, "Width and height in pixels")
      .default_text(fmt::format("{}x{}", options.width, options.height));
}

std::vector<Option> add_camera(Command command, Camera& camera) {
  return {
      command.add("--azimuth", &camera.azimuth, "NUMBER",
                  "Degrees the camera is turned about the up axis"),
      command.add("--elevation", &camera.elevation, "NUMBER",
                  "Degrees of the camera above the horizon"),
      command.add("--zoom", &camera.zoom, "NUMBER", "1 frames the whole shape, 2 half of it"),
      add_vector(
          command, "--look-at", camera.look_at,
          "The point in the middle of the picture, shape units. Default: the middle of what is "
          "framed"),
      add_box(command, "--frame", camera.frame,
              "What fills the picture at zoom 1, shape units, seen from as far as the whole shape "
              "would be. Default: the whole shape"),
      command.add("--field-of-view", &camera.field_of_view, "NUMBER", "Degrees, vertical"),
      add_up(command, camera.up,
             "The shape's axis that points up; auto is what the map says, or y where it says "
             "nothing. Of a mesh it is a guess: its flattest, widest end is down"),
  };
}

void add_look(Command command, LookOptions& look, PictureOptions& options) {
  command
      .add("--background", &look.background, "studio|transparent|COLOUR",
           std::string("What is behind the set: studio, light grey; transparent, a .png with "
                       "alpha, in which the set's shadow is black and lets what is behind shine "
                       "through; or a colour: ") +
               kColorWords)
      .group(kLookGroup);
  command.flag("--no-ground", look.no_ground, "Leave out the ground under the set, and its shadow")
      .group(kLookGroup);
  command
      .flag("--keep-loose", options.keep_loose,
            "Draw all connected parts of the set. Default: parts less than a hundredth as large as "
            "the largest are left out, as 'qjulia surface' does")
      .group(kLookGroup);
  command
      .add("--palette", &look.palette, "NAME|COLOURS",
           fmt::format("The set's colours: {}; or colours of your own, one for clay, 2 to {} with "
                       "commas between for other materials, from low to high",
                       fmt::join(palette_names(), ", "), Palette::kMostStops))
      .group(kLookGroup);
  const auto set_lamp = [&options](const std::vector<double>& v) {
    options.lamp = {v[0], v[1], v[2]};
  };
  command
      .numbers("--lamp", "AZIMUTH ELEVATION STRENGTH", set_lamp,
               "The brightest light: degrees from the camera to the right, degrees above the "
               "horizon, and how strong it is, 0 to 10")
      .group(kLookGroup)
      .default_text("-61.7 41.4 1");
}

PictureOptions with_look(PictureOptions options, const LookOptions& look) {
  options.ground = !look.no_ground;
  options.palette = palette_of(look.palette, options.material);
  if (look.background == "transparent") {
    options.backdrop = Backdrop::transparent;
  } else if (look.background != "studio") {
    options.backdrop = Backdrop::plain;
    options.background = color_of("--background", look.background, "studio or transparent");
  }
  return options;
}

}  // namespace qjulia::tools
