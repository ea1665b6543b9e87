#include "describe/picture_options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/text.hpp"
#include "describe/options.hpp"
#include "describe/setting_option.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/picture/look.hpp"
#include "qjulia/picture/picture_settings.hpp"

namespace qjulia::tools {
namespace {

constexpr const char* kLookGroup = "Look of the picture";

}  // namespace

Option add_picture_setting(Command command, std::string_view name, PictureOptions& options) {
  const PictureSetting& setting = picture_setting_named(name);
  return add_setting(command, setting, setting.place(options));
}

std::vector<Option> add_camera(Command command, PictureOptions& options) {
  std::vector<Option> added;
  for (const char* name : {"azimuth", "elevation", "zoom", "look_at", "distance", "frame",
                           "field_of_view", "aperture", "focus", "up"}) {
    added.push_back(add_picture_setting(command, name, options));
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

void add_look(Command command, std::optional<std::string>& palette, PictureOptions& options) {
  for (const PictureSetting& setting : picture_settings()) {
    const bool is_elsewhere = setting.name == "material" || setting.name == "palette";
    if (!setting.is_of_look || is_elsewhere) continue;
    add_setting(command, setting, setting.place(options)).group(kLookGroup);
  }
  add_picture_setting(command, "keep_loose", options).group(kLookGroup);
  add_palette(command, palette,
              fmt::format("The set's colours: {}; or colours of your own, one for clay, 2 to {} "
                          "with commas between for other materials, from low to high",
                          fmt::join(palette_names(), ", "), Palette::kMostStops))
      .group(kLookGroup);
}

}  // namespace qjulia::tools
