#include "look_options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "qjulia/error.hpp"

namespace qjulia::tools {
namespace {

constexpr const char* kLookGroup = "Look of the picture";
constexpr const char* kColorWords = "RRGGBB (sRGB, such as ff8000), white or black";

std::vector<std::string> words_between_commas(const std::string& text) {
  std::vector<std::string> words;
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t comma = std::min(text.find(',', from), text.size());
    words.push_back(text.substr(from, comma - from));
    from = comma + 1;
  }
  return words;
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
  for (const std::string& word : words_between_commas(text)) {
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

void add_look(Command command, LookOptions& look) {
  command
      .add("--background", &look.background,
           std::string("What is behind the set: studio, light grey; transparent, a .png with "
                       "alpha, in which the set's shadow is black and lets what is behind shine "
                       "through; or a colour: ") +
               kColorWords)
      .group(kLookGroup)
      .type("studio|transparent|COLOUR");
  command.flag("--no-ground", look.no_ground, "Leave out the ground under the set, and its shadow")
      .group(kLookGroup);
  command
      .flag("--keep-loose", look.keep_loose,
            "Draw all connected parts of the set. Default: parts less than a hundredth as large as "
            "the largest are left out, as 'qjulia surface' does")
      .group(kLookGroup);
  command
      .add("--palette", &look.palette,
           fmt::format("The set's colours: {}; or colours of your own, one for clay, 2 to {} with "
                       "commas between for other materials, from low to high",
                       fmt::join(palette_names(), ", "), Palette::kMostStops))
      .group(kLookGroup)
      .type("NAME|COLOURS");
  command
      .numbers(
          "--lamp", 3,
          [&look](const std::vector<double>& v) {
            look.lamp = {v[0], v[1], v[2]};
          },
          "The brightest light: degrees from the camera to the right, degrees above the horizon, "
          "and how strong it is, 0 to 10")
      .group(kLookGroup)
      .type("AZIMUTH ELEVATION STRENGTH")
      .default_text("-61.7 41.4 1");
}

PictureOptions with_look(PictureOptions options, const LookOptions& look) {
  options.ground = !look.no_ground;
  options.keep_loose = look.keep_loose;
  options.lamp = look.lamp;
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
