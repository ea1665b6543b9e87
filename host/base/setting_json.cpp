#include "base/setting_json.hpp"

#include <cmath>
#include <type_traits>

#include "qjulia/base/colors.hpp"
#include "qjulia/picture/picture.hpp"

namespace qjulia::base {
namespace {

using nlohmann::json;

/// Null for a number that is not finite.
template <class Number>
requires std::is_arithmetic_v<Number> json json_of(Number number) {
  if constexpr (std::is_floating_point_v<Number>) {
    if (!std::isfinite(number)) return nullptr;
  }
  return number;
}
json json_of(const std::string& text) { return text; }
json json_of(const Eigen::Vector3d& v) { return json::array({v.x(), v.y(), v.z()}); }
json json_of(const Quaternion& q) { return json::array({q.x, q.y, q.z, q.w}); }
json json_of(const Rotation& rotation) {
  const Eigen::Vector3d& axis = rotation.axis;
  return json::array({axis.x(), axis.y(), axis.z(), rotation.degrees});
}
json json_of(const Box& box) { return json::array({json_of(box.low), json_of(box.high)}); }
json json_of(const LightColor& color) { return to_string(color); }
json json_of(const Background& background) { return to_string(background); }
json json_of(const std::vector<Lamp>& lamps) {
  json all = json::array();
  for (const Lamp& lamp : lamps) {
    all.push_back({lamp.azimuth, lamp.elevation, lamp.strength, to_string(lamp.color), lamp.size});
  }
  return all;
}
json json_of(const std::vector<Cut>& cuts) { return to_string(cuts); }
json json_of(const MaterialRange& range) { return range.values(); }
json json_of(const Palette& palette) {
  json names = json::array();
  for (const Rgb& stop : palette.stops) names.push_back(color_name(stop));
  return names;
}
json json_of(const DetailChoice& detail) {
  if (const auto* number = std::get_if<double>(&detail)) return *number;
  return to_string(detail);
}
json json_of(UpAxis up) { return to_string(up); }

class ValueJson {
 public:
  explicit ValueJson(const Setting& setting) : setting_(setting) {}

  json operator()(const WordPlace& value) const { return setting_.words.at(value.index()); }
  json operator()(const SizePlace& size) const { return size.text(); }
  template <class Value>
  json operator()(const Value* value) const {
    return json_of(*value);
  }
  template <class Value>
  json operator()(const std::optional<Value>* value) const {
    if (*value) return json_of(**value);
    return setting_.automatic.empty() ? json() : json(setting_.automatic);
  }

 private:
  const Setting& setting_;
};

}  // namespace

json value_json(const Box& box) { return json_of(box); }
json value_json(const Palette& palette) { return json_of(palette); }

json value_json(const Setting& setting, const ValuePlace& place) {
  return std::visit(ValueJson(setting), place);
}

}  // namespace qjulia::base
