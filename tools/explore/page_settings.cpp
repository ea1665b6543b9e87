#include "explore/page_settings.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "qjulia/base/colors.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/knob_table.hpp"
#include "qjulia/picture/materials.hpp"
#include "qjulia/picture/picture_settings.hpp"

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

/// The form of each type of value that pages have controls for.
class FormOf {
 public:
  explicit FormOf(const Setting& setting) : setting_(setting) {}

  Form operator()(const double* value) const { return {"numbers", {*value}}; }
  Form operator()(const int* value) const { return {"numbers", {*value}}; }
  /// Null where it is not given, and the page finds it.
  Form operator()(const std::optional<double>* value) const {
    return {"numbers", {*value ? json(**value) : json()}};
  }
  Form operator()(const std::optional<std::uint64_t>* value) const {
    return {"seed", {value->value_or(0)}};
  }
  Form operator()(const std::optional<Eigen::Vector3d>*) const { return {"point", {nullptr}}; }
  Form operator()(const std::optional<Quaternion>* value) const {
    return {"phase", angles_of(value->value_or(Quaternion{}))};
  }
  Form operator()(const std::optional<Rotation>* value) const {
    return {"rotation", {value->value_or(Rotation{}).degrees, "x"}};
  }
  Form operator()(const WordPlace& value) const {
    return {"word", {setting_.words.at(value.index())}};
  }
  Form operator()(const std::string* value) const {
    return {"word", {value->empty() ? "none" : *value}};
  }
  Form operator()(const Palette*) const { return {"word", {palette_names().front()}}; }
  Form operator()(const std::optional<UpAxis>* value) const {
    return {"word", {to_string(value->value_or(UpAxis{}))}};
  }
  /// Of the key light.
  Form operator()(const std::vector<Lamp>*) const {
    const Lamp key = rig_named(RigName::studio).lamps.front();
    return {"lamp", {key.azimuth, key.elevation, key.strength}};
  }
  Form operator()(const SizePlace&) const { return none(); }
  template <class Value>
  Form operator()(const Value*) const {
    return none();
  }

 private:
  [[noreturn]] Form none() const { throw Error("pages have no control for " + setting_.name); }

  const Setting& setting_;
};

/// @param most what the map bears.
json control_json(const Control& control, const Setting& setting, const json& usual, double most) {
  json made = {{"name", control.name},
               {"label", control.label},
               {"help", control.help.empty() ? setting.help : control.help},
               {"usual", usual}};
  const std::vector<std::string>& words = control.words.empty() ? setting.words : control.words;
  if (!words.empty()) {
    made["words"] = json::array({usual});  // the usual one first
    for (const std::string& word : words) {
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

json list_of_point(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }

json frame_json(const Frame& frame) {
  json made = {{"scale", frame.shape_to_map.scale},
               {"translation", list_of_point(frame.shape_to_map.translation)},
               {"box", nullptr}};
  if (frame.box) made["box"] = {list_of_point(frame.box->low), list_of_point(frame.box->high)};
  return made;
}

json setting_json(const Setting& setting, const Form& form, double most) {
  json controls = json::array();
  for (std::size_t i = 0; i < setting.controls.size(); ++i) {
    controls.push_back(control_json(setting.controls[i], setting, form.usual.at(i), most));
  }
  return {{"option", setting.option()},
          {"type", form.type},
          {"group", setting.group},
          {"controls", controls}};
}

}  // namespace

std::string page_settings(const Map& map, const PageScene* scene) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  PictureOptions usual;
  usual.camera.up = map.frame.up.value_or(kDefaultUp);
  MapKnobs knobs = knobs_of(map);
  json of_map = json::array(), of_picture = json::array(), absent = json::array();
  const auto is_absent = [&](const Setting& setting) {
    if (scene == nullptr || !setting.controls.front().needs_server) return false;
    absent.push_back(setting.controls.front().label);
    return true;
  };
  for (PictureSetting setting : picture_settings()) {
    if (setting.controls.empty() || is_absent(setting)) continue;
    if (setting.name == "material" && map.dynamics.factors.empty()) {
      for (const MaterialFacts& facts : materials()) {
        if (facts.needs_factors) std::erase(setting.words, facts.word);
      }
    }
    const Form form = std::visit(FormOf(setting), setting.place(usual));
    (setting.name == "iterations" ? of_map : of_picture)
        .push_back(setting_json(setting, form, kInfinity));
  }
  for (const Knob& knob : knob_table()) {
    if (knob.controls.empty() || !knob.why_not(map).empty() || is_absent(knob)) continue;
    const Form form = std::visit(FormOf(knob), knob.place(knobs));
    const bool is_drift = scene != nullptr && knob.name == "drift";
    of_map.push_back(setting_json(knob, form, is_drift ? scene->most_drift : knob.most_of(map)));
  }
  return json{{"map", of_map},
              {"picture", of_picture},
              {"frame", frame_json(map.frame)},
              {"absent", absent}}
      .dump();
}

}  // namespace qjulia::explore
