#include "describe/picture_note.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "base/setting_json.hpp"
#include "base/text.hpp"
#include "describe/files.hpp"
#include "describe/map_options.hpp"
#include "describe/provenance.hpp"
#include "qjulia/map/knob_table.hpp"
#include "qjulia/picture/picture_settings.hpp"

namespace qjulia::tools {
namespace {

/// The text; nothing where it would do something to a terminal, as no note of ours does.
std::string printable(const std::string& text) {
  const auto is_control = [](unsigned char c) { return c < 0x20 || c == 0x7F; };
  return std::ranges::any_of(text, is_control) ? std::string() : text;
}

/// The name of the palette with these colours, if it has one; else the colours.
std::string palette_word(const nlohmann::json& colors) {
  for (const std::string& name : palette_names()) {
    const Palette palette = *palette_named(name);
    if (base::value_json(palette) == colors ||
        nlohmann::json::array({color_name(palette.clay)}) == colors) {
      return name;
    }
  }
  std::vector<std::string> names;
  for (const nlohmann::json& color : colors) names.push_back(color.get<std::string>());
  return fmt::format("{}", fmt::join(names, ","));
}

/// The values of a page's controls of one setting, where it has such controls.
std::vector<nlohmann::json> control_values(const std::string& name, const nlohmann::json& value) {
  if (name == "look_at") {
    std::vector<std::string> numbers;
    for (const nlohmann::json& number : value) numbers.push_back(number.dump());
    return {fmt::format("{}", fmt::join(numbers, ","))};
  }
  if (name == "palette") return {palette_word(value)};
  if (name == "lamp") return value.at(0).get<std::vector<nlohmann::json>>();
  if (value.is_array()) return value.get<std::vector<nlohmann::json>>();
  return {value};
}

}  // namespace

std::string page_state(const nlohmann::json& made) {
  std::vector<std::string> words;
  try {
    const nlohmann::json usual = to_json(PictureOptions{});
    const nlohmann::json& picture = made.at("picture");
    for (const PictureSetting& setting : picture_settings()) {
      if (!picture.contains(setting.name) || picture.at(setting.name) == usual.at(setting.name) ||
          picture.at(setting.name).is_null()) {
        continue;
      }
      const auto values = control_values(setting.name, picture.at(setting.name));
      for (std::size_t i = 0; i < std::min(values.size(), setting.controls.size()); ++i) {
        const std::string value =
            values[i].is_string() ? values[i].get<std::string>() : values[i].dump();
        words.push_back(fmt::format("{}={}", setting.controls[i].name,
                                    base::percent_encoded(value, ",")));  // "+" would be a space
      }
    }
    if (const auto text = picture.at("cut").get<std::string>(); !text.empty()) {
      for (const Cut& cut : cuts_from(text)) {
        if (!cut.is_percent) continue;
        words.push_back(
            fmt::format("cut{}={}", cut.axis, base::percent_encoded(fmt::format("{}", cut.at))));
      }
    }
  } catch (const nlohmann::json::exception&) {
    return {};  // another version's note
  } catch (const InputError&) {
    return {};  // a damaged one
  }
  return printable(fmt::format("{}", fmt::join(words, "&")));
}

}  // namespace qjulia::tools
