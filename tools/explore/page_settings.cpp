#include "explore/page_settings.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "qjulia/field.hpp"
#include "qjulia/knob_table.hpp"
#include "qjulia/picture_settings.hpp"

namespace qjulia::explore {
namespace {

using nlohmann::json;

/// How a page goes from the controls of a setting to its value and back.
struct Form {
  const char* type;
  std::vector<json> usual;  ///< a control's each
};

/// Degrees of phi, psi, chi in cos phi + sin phi (i cos psi + j sin psi cos chi + k sin psi sin
/// chi).
std::vector<json> angles_of(const Quaternion& q) {
  const auto degrees = [](double y, double x) { return std::atan2(y, x) * 180 / std::numbers::pi; };
  return {degrees(std::hypot(q.y, q.z, q.w), q.x), degrees(std::hypot(q.z, q.w), q.y),
          degrees(q.w, q.z)};
}

Form form_of(double value) { return {"numbers", {value}}; }
Form form_of(int value) { return {"numbers", {value}}; }
Form form_of(std::uint64_t value) { return {"seed", {value}}; }
/// Null where it is not given, and the page finds it.
Form form_of(const std::optional<double>& value) {
  return value ? form_of(*value) : Form{"numbers", {nullptr}};
}
Form form_of(const Eigen::Vector3d&) { return {"point", {nullptr}}; }
Form form_of(const Box&) { return {"point", {nullptr}}; }
Form form_of(const Quaternion& value) { return {"phase", angles_of(value)}; }
Form form_of(const Rotation& value) { return {"rotation", {value.degrees, "x"}}; }
Form form_of(Material value) { return {"word", {to_string(value)}}; }
Form form_of(const Palette&) { return {"word", {palette_names().front()}}; }
Form form_of(UpAxis value) { return {"word", {to_string(value)}}; }
Form form_of(const Lamp& lamp) {
  return {"numbers", {lamp.azimuth, lamp.elevation, lamp.strength}};
}

template <class Value>
Form form_of(const std::optional<Value>& value) {
  return form_of(value.value_or(Value{}));
}

/// @param most what the map bears.
json control_json(const Control& control, const std::string& help, const json& usual, double most) {
  json made = {{"name", control.name},
               {"label", control.label},
               {"help", control.help.empty() ? help : control.help},
               {"usual", usual}};
  if (!control.words.empty()) {
    made["words"] = json::array({usual});  // the usual one first
    for (const std::string& word : control.words) {
      if (json(word) != usual) made["words"].push_back(word);
    }
    return made;
  }
  if (!usual.is_number()) return made;
  const auto value = usual.get<double>();
  made["least"] = std::min(control.least, value);
  made["most"] = std::max(std::min(control.most, most), value);
  made["step"] = control.step;
  made["log"] = control.is_logarithmic;
  made["whole"] = control.is_whole;
  return made;
}

json setting_json(const Setting& setting, const Form& form, double most) {
  json controls = json::array();
  for (std::size_t i = 0; i < setting.controls.size(); ++i) {
    controls.push_back(control_json(setting.controls[i], setting.help, form.usual.at(i), most));
  }
  return {{"option", setting.option()},
          {"type", form.type},
          {"group", setting.group},
          {"controls", controls}};
}

}  // namespace

std::string page_settings(const Map& map) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  PictureOptions usual;
  usual.camera.up = map.frame.up.value_or(kDefaultUp);
  const MapKnobs knobs = knobs_of(map);
  json of_map = json::array(), of_picture = json::array();
  for (const PictureSetting& setting : picture_settings()) {
    if (setting.controls.empty()) continue;
    const Form form =
        std::visit([&](const auto place) { return form_of(place(usual)); }, setting.value);
    (setting.name == "iterations" ? of_map : of_picture)
        .push_back(setting_json(setting, form, kInfinity));
  }
  for (const Knob& knob : knob_table()) {
    if (knob.controls.empty() || !knob.why_not(map).empty()) continue;
    const Form form =
        std::visit([&](const auto member) { return form_of(knobs.*member); }, knob.value);
    of_map.push_back(setting_json(knob, form, knob.most_of(map)));
  }
  return json{{"map", of_map}, {"picture", of_picture}, {"escape", kUsualEscape}}.dump();
}

}  // namespace qjulia::explore
