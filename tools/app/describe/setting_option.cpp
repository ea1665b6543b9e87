#include "describe/setting_option.hpp"

#include <fmt/format.h>

#include <cctype>
#include <functional>
#include <optional>
#include <regex>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/text.hpp"
#include "describe/options.hpp"
#include "qjulia/picture/picture.hpp"

namespace qjulia::tools {
namespace {

/// Adds the option for each type of value.
class SettingOption {
 public:
  SettingOption(Command command, const Setting& setting, const ValuePlace& place)
      : command_(command), setting_(setting), name_("--" + option_of(setting, place)) {}

  Option operator()(bool* value) const {
    std::string text = help();
    if (*value) {  // "--no-ground"
      text.front() = static_cast<char>(std::tolower(static_cast<unsigned char>(text.front())));
      text = "Leave out " + text;
    }
    return command_.flag(name(), *value, text);
  }
  Option operator()(std::string* value) const { return plain(value); }
  template <class Number>
  requires std::is_arithmetic_v<Number> Option operator()(Number* value) const {
    return plain(value);
  }
  template <class Number>
  requires std::is_arithmetic_v<Number> Option operator()(std::optional<Number>* value) const {
    if (setting_.automatic.empty()) return plain(value);
    const auto take = [automatic = setting_.automatic, value](const std::string& text) {
      value->reset();
      if (text != automatic) read_value(text, value);
    };
    const Option option = command_.word(name(), setting_.values, take, help());
    option.offers({setting_.automatic});
    return option.default_text(*value ? fmt::format("{}", **value) : setting_.automatic);
  }
  Option operator()(const WordPlace& value) const {
    const auto take = [setting = setting_, value](const std::string& word) {
      value.set(setting.index_of(word));
    };
    return command_.word(name(), setting_.values_text(), take, help())
        .default_text(setting_.words.at(value.index()))
        .offers(setting_.words);
  }
  Option operator()(const SizePlace& size) const {
    const auto take = [size](const std::string& text) { size.read(text); };
    return command_.word(name(), setting_.values, take, help()).default_text(size.text());
  }
  Option operator()(std::vector<Cut>* value) const {
    const auto take = [value](const std::string& text) { *value = cuts_from(text); };
    return command_.word(name(), setting_.values, take, help());
  }
  Option operator()(std::optional<MaterialRange>* value) const {
    const auto take = [value](const std::string& text) { *value = range_from(text); };
    return command_.word(name(), setting_.values, take, help());
  }
  Option operator()(DetailChoice* value) const {
    const auto take = [setting = setting_, value](const std::string& text) {
      *value = read_detail(setting, text);
    };
    return command_.word(name(), setting_.values, take, help())
        .default_text(to_string(*value))
        .offers({"auto", "smooth", "clear", "wild"});
  }
  Option operator()(std::optional<UpAxis>* value) const {
    const auto take = [automatic = setting_.automatic, value](const std::string& word) {
      *value = up_axis_named(word);
      if (*value || word == automatic) return;
      throw InputError(
          fmt::format("'{}' is no direction; give x, y, z, -x, -y, -z or {}", word, automatic));
    };
    return command_.word(name(), setting_.values, take, help())
        .default_text(setting_.automatic)
        .offers({"x", "y", "z", "-x", "-y", "-z", setting_.automatic});
  }
  Option operator()(std::optional<Eigen::Vector3d>* value) const {
    return add_vector(command_, name(), *value, help());
  }
  Option operator()(std::optional<Box>* value) const {
    return add_box(command_, name(), *value, help());
  }
  Option operator()(Quaternion* value) const {
    return numbers([value](const auto& v) {
             *value = {v[0], v[1], v[2], v[3]};
           })
        .default_text(fmt::format("{} {} {} {}", value->x, value->y, value->z, value->w));
  }
  Option operator()(std::optional<Quaternion>* value) const {
    return numbers([value](const auto& v) { *value = Quaternion{v[0], v[1], v[2], v[3]}; });
  }
  Option operator()(std::optional<Rotation>* value) const {
    return numbers([value](const auto& v) { *value = Rotation{{v[0], v[1], v[2]}, v[3]}; });
  }
  Option operator()(std::vector<Lamp>* value) const {
    const auto take = [value](const std::vector<std::string>& given) {
      value->clear();
      for (const std::string& text : given) value->push_back(lamp_from(text));
    };
    return command_.repeated_word(name(), setting_.values, static_cast<int>(Rig::kMostLamps), take,
                                  help());
  }
  Option operator()(std::optional<LightColor>* value) const {
    const auto take = [value](const std::string& text) { *value = light_color_from(text); };
    return command_.word(name(), setting_.values, take, help());
  }
  Option operator()(Background* value) const {
    const auto take = [value](const std::string& text) { *value = background_from(text); };
    return command_.word(name(), setting_.values, take, help())
        .default_text(to_string(*value))
        .offers({"studio", "transparent", "environment", "white", "black"});
  }
  Option operator()(Palette*) const { throw Error("a palette is read together with the material"); }

 private:
  const std::string& name() const { return name_; }
  std::string help() const { return help_of(setting_); }
  template <class Value>
  Option plain(Value* value) const {
    return command_.add(name(), value, setting_.values, help());
  }
  Option numbers(std::function<void(const std::vector<double>&)> take) const {
    return command_.numbers(name(), setting_.values, std::move(take), help());
  }

  Command command_;
  const Setting& setting_;
  std::string name_;
};

}  // namespace

Option add_setting(Command command, const Setting& setting, const ValuePlace& place) {
  return std::visit(SettingOption(command, setting, place), place).example(setting.example.words());
}

std::string help_of(const Setting& setting) {
  std::string text = setting.help;
  if (!setting.left_out.empty()) text += ". Default: " + setting.left_out;
  // Other settings are options here: `max_triangles` is --max-triangles.
  static const std::regex name("`([a-z_]+)`");
  std::string shown;
  for (std::smatch found; std::regex_search(text, found, name); text = found.suffix()) {
    shown += fmt::format("{}--{}", found.prefix().str(),
                         Setting{.name = found[1], .example = "", .help = ""}.option());
  }
  return shown + text;
}

Setting with_help(const Setting& setting, std::string help) {
  Setting made = setting;
  made.help = std::move(help);
  return made;
}

DetailChoice read_detail(const Setting& setting, const std::string& text) {
  if (const auto word = detail_word_named(text)) return *word;
  double number = 0;
  try {
    number = finite_number(text);
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}; give one, or auto, smooth, clear or wild", error.what()));
  }
  setting.expect_in_range(number);
  return number;
}

}  // namespace qjulia::tools
