#include "picture_note.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "base/setting_json.hpp"
#include "base/text.hpp"
#include "files.hpp"
#include "map_options.hpp"
#include "provenance.hpp"
#include "qjulia/knob_table.hpp"
#include "qjulia/picture_settings.hpp"

namespace qjulia::tools {
namespace {

/// The words of a value: numbers to the last bit, the parts of vectors and boxes one by one.
void add_words(const nlohmann::json& value, std::vector<std::string>& words) {
  if (value.is_array()) {
    for (const nlohmann::json& part : value) add_words(part, words);
  } else if (const std::string word = value.is_string() ? value.get<std::string>() : value.dump();
             word.starts_with('-')) {
    // A negative number, or an axis: no file, which would begin with "./".
    words.push_back('-' + shell_word(word.substr(1)));
  } else {
    words.push_back(shell_word(word));
  }
}

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

/// "z=50%,x=0.2".
std::string cuts_word(const nlohmann::json& cuts) {
  std::vector<std::string> words;
  for (const nlohmann::json& cut : cuts) {
    words.push_back(fmt::format("{}={}{}", cut.at("axis").get<std::string>(),
                                cut.at("at").get<double>(),
                                cut.at("unit") == "percent" ? "%" : ""));
  }
  return fmt::format("{}", fmt::join(words, ","));
}

class CommandWords {
 public:
  explicit CommandWords(std::vector<std::string> words) : words_(std::move(words)) {}

  void flag(const std::string& name) { words_.push_back(fmt::format("--{}", name)); }
  void option(const std::string& name, const nlohmann::json& value) {
    flag(name);
    add_words(value, words_);
  }
  std::string text() const { return fmt::format("{}", fmt::join(words_, " ")); }

 private:
  std::vector<std::string> words_;
};

/// @param range its values from first to last.
void add_range(const nlohmann::json& range, CommandWords& command) {
  command.option("range", nlohmann::json::array({range.front(), range.back()}));
  std::vector<std::string> between;
  for (std::size_t i = 1; i + 1 < range.size(); ++i) between.push_back(range.at(i).dump());
  if (!between.empty()) command.option("range-between", fmt::format("{}", fmt::join(between, ",")));
}

/// The look and the camera, where they differ from the defaults.
void add_picture(const nlohmann::json& picture, CommandWords& command) {
  const nlohmann::json usual = to_json(PictureOptions{});
  const auto differs = [&](const char* name) { return picture.at(name) != usual.at(name); };
  if (differs("width") || differs("height")) {
    command.option("size", fmt::format("{}x{}", picture.at("width").get<int>(),
                                       picture.at("height").get<int>()));
  }
  if (differs("samples")) command.option("samples", picture.at("samples"));
  for (const PictureSetting& setting : picture_settings()) {
    if (!picture.contains(setting.name)) continue;
    const nlohmann::json& value = picture.at(setting.name);
    const nlohmann::json& other = usual.at(setting.name);
    if (setting.name == "palette") {
      if (const std::string word = palette_word(value); word != palette_names().front()) {
        command.option(setting.option(), word);
      }
    } else if (value != other && !value.is_null()) {
      command.option(setting.option(), value);
    }
  }
  if (differs("cuts")) command.option("cut", cuts_word(picture.at("cuts")));
  if (differs("background")) command.option("background", picture.at("background"));
  if (differs("ground")) command.flag("no-ground");
  if (differs("keep_loose")) command.flag("keep-loose");
  if (differs("exact")) command.flag("exact");
  if (picture.contains("range")) add_range(picture.at("range"), command);
}

/// The options of the map; its knobs where `has_knobs`.
void add_map(const nlohmann::json& options, bool has_knobs, CommandWords& command) {
  const nlohmann::json usual = to_json(MapOptions{});
  for (const char* name : {"iterations", "precision", "box", "escape"}) {
    if (options.at(name) != usual.at(name)) command.option(name, options.at(name));
  }
  for (const Knob& knob : knob_table()) {
    if (!has_knobs || !options.contains(knob.name)) continue;
    const nlohmann::json& value = options.at(knob.name);
    if (value != usual.at(knob.name)) command.option(knob.option(), value);
  }
}

/// The values of a page's controls of one setting, where it has such controls.
std::vector<nlohmann::json> control_values(const std::string& name, const nlohmann::json& value) {
  if (name == "look_at") {
    std::vector<std::string> words;
    add_words(value, words);
    return {fmt::format("{}", fmt::join(words, ","))};
  }
  if (name == "palette") return {palette_word(value)};
  if (value.is_array()) return value.get<std::vector<nlohmann::json>>();
  return {value};
}

}  // namespace

std::string render_command(const nlohmann::json& made, const std::string& picture, bool holds_map) {
  if (!made.contains("picture") || !made.contains("map_options") || made.contains("sweep"))
    return {};
  try {
    const std::string input = holds_map ? picture : made.at("input").at("name").get<std::string>();
    CommandWords command({"qjulia", "render", shell_word(input), "-o", "again.png"});
    add_map(made.at("map_options"), !holds_map, command);
    add_picture(made.at("picture"), command);
    return printable(command.text());
  } catch (const nlohmann::json::exception&) {
    return {};  // another version's note
  }
}

std::string page_state(const nlohmann::json& made) {
  std::vector<std::string> words;
  try {
    const nlohmann::json usual = to_json(PictureOptions{});
    const nlohmann::json& picture = made.at("picture");
    const nlohmann::json& options = made.at("map_options");
    if (const nlohmann::json& n = options.at("iterations");
        n != to_json(MapOptions{}).at("iterations")) {
      words.push_back(fmt::format("iterations={}", n.dump()));
    }
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
    for (const nlohmann::json& cut : picture.at("cuts")) {
      if (cut.at("unit") != "percent") continue;
      words.push_back(fmt::format("cut{}={}",
                                  base::percent_encoded(cut.at("axis").get<std::string>()),
                                  base::percent_encoded(cut.at("at").dump())));
    }
  } catch (const nlohmann::json::exception&) {
    return {};  // another version's note
  }
  return printable(fmt::format("{}", fmt::join(words, "&")));
}

}  // namespace qjulia::tools
