#include "picture_options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>

#include "base/text.hpp"
#include "options.hpp"
#include "qjulia/error.hpp"
#include "qjulia/look.hpp"
#include "qjulia/picture_settings.hpp"
#include "setting_option.hpp"

namespace qjulia::tools {
namespace {

constexpr const char* kLookGroup = "Look of the picture";

/// "1280x960" as width and height. @throws InputError
std::array<int, 2> parse_size(const std::string& text) {
  if (const auto words = base::split(text, 'x'); words.size() == 2) {
    const std::array size{base::number_in<int>(words[0]).value_or(0),
                          base::number_in<int>(words[1]).value_or(0)};
    if (size[0] > 0 && size[1] > 0) return size;
  }
  throw InputError(fmt::format("'{}' is not WIDTHxHEIGHT in pixels, such as 1280x960", text));
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

std::vector<Option> add_camera(Command command, PictureOptions& options) {
  std::vector<Option> added;
  for (const char* name : {"azimuth", "elevation", "zoom", "look_at", "distance", "frame",
                           "field_of_view", "aperture", "focus", "up"}) {
    const PictureSetting& setting = picture_setting_named(name);
    added.push_back(add_setting(command, setting, setting.place(options)));
  }
  return added;
}

Option add_look_name(Command command, PictureOptions& options) {
  const PictureSetting& setting = picture_setting_named("look");
  return command
      .word(
          "--look", setting.values,
          [&options](const std::string& text) { apply_look(options, text); }, help_of(setting))
      .offers(look_names())
      .offers_files({".toml"})
      .example(setting.example.words());
}

Option add_material(Command command, PictureOptions& options) {
  const PictureSetting& setting = picture_setting_named("material");
  return add_setting(command, setting, setting.place(options));
}

Option add_palette(Command command, std::optional<std::string>& palette,
                   const std::string& description) {
  return command
      .word(
          "--palette", "NAME|COLOURS", [&palette](const std::string& text) { palette = text; },
          description)
      .default_text(palette_names().front())
      .offers(palette_names());
}

Palette palette_of(const std::string& text, Material material) {
  return palette_from(base::split(text, ','), material);
}

std::vector<Option> add_range(Command command, std::optional<MaterialRange>& range) {
  const auto given = [&range]() -> MaterialRange& { return range ? *range : range.emplace(); };
  const auto take = [given](const std::vector<double>& v) {
    given().low = v[0];
    given().high = v[1];
  };
  const Option ends = command.numbers(
      "--range", "LOW HIGH", take,
      "The values of --material at which the palette begins and ends. Default: the palette is "
      "spread so that each part of it is seen about as much as any other; a series of pictures is "
      "treated as one. The note in a picture holds its range; give it again to keep the colours in "
      "other pictures, maps and meshes");
  const Option between = command.word(
      "--range-between", "A,B,...",
      [given](const std::string& text) {
        given().between.clear();
        for (const std::string& word : base::split(text, ',')) {
          given().between.push_back(finite_number(word));
        }
      },
      "Values between those of --range, separated by commas; they and those of --range divide the "
      "palette into equal parts. Default: none if --range is given, and the palette is then spread "
      "evenly");
  return {ends, between};
}

void add_look(Command command, LookOptions& look, PictureOptions& options) {
  for (const PictureSetting& setting : picture_settings()) {
    const bool is_elsewhere = setting.name == "material" || setting.name == "palette";
    if (!setting.is_of_look || is_elsewhere) continue;
    add_setting(command, setting, setting.place(options)).group(kLookGroup);
  }
  command.flag("--no-ground", look.no_ground, "Leave out the ground under the set, and its shadow")
      .group(kLookGroup);
  command
      .flag("--keep-loose", options.keep_loose,
            "Draw all connected parts of the set. Default: parts less than a hundredth as large as "
            "the largest are left out, as 'qjulia surface' does")
      .group(kLookGroup);
  add_palette(command, look.palette,
              fmt::format("The set's colours: {}; or colours of your own, one for clay, 2 to {} "
                          "with commas between for other materials, from low to high",
                          fmt::join(palette_names(), ", "), Palette::kMostStops))
      .group(kLookGroup);
  for (const Option& option : add_range(command, options.range)) option.group(kLookGroup);
}

PictureOptions with_look(PictureOptions options, const LookOptions& look) {
  if (look.no_ground) options.ground = false;
  if (look.palette) options.palette = palette_of(*look.palette, options.material);
  return options;
}

}  // namespace qjulia::tools
