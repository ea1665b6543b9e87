#include <fmt/format.h>
#include <fmt/ranges.h>

#include "qjulia/base/error.hpp"
#include "qjulia/picture/picture.hpp"

namespace qjulia {

Palette palette_from(std::span<const std::string> words, Material material) {
  if (words.size() == 1) {
    if (const auto named = palette_named(words.front())) return *named;
  }
  std::vector<Rgb> colors;
  for (const std::string& word : words) {
    const auto color = color_named(word);
    if (!color) {
      throw OptionError(
          "palette", fmt::format("'{}' is no colour; give RRGGBB (sRGB, such as ff8000), white or "
                                 "black, or a palette: {}",
                                 word, fmt::join(palette_names(), ", ")));
    }
    colors.push_back(*color);
  }
  const bool is_clay = material == Material::clay;
  if (is_clay && colors.size() != 1) {
    throw OptionError("palette",
                      fmt::format("clay has one colour, and {} are given; give one, or another "
                                  "material",
                                  colors.size()));
  }
  if (!is_clay && (colors.size() < 2 || colors.size() > Palette::kMostStops)) {
    throw OptionError("palette",
                      fmt::format("{} given; the material {} goes through 2 to {} colours, such as "
                                  "14281d,8a9a5b,e9e4c9",
                                  colors.size(), to_string(material), Palette::kMostStops));
  }
  Palette palette;
  if (is_clay) {
    palette.clay = colors.front();
  } else {
    palette.clay = colors[colors.size() * 5 / 8];  // for meshes
    palette.stops = std::move(colors);
  }
  return palette;
}

}  // namespace qjulia
