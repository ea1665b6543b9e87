#include "setting_json.hpp"

namespace qjulia::tools {

nlohmann::json value_json(const Eigen::Vector3d& vector) {
  return nlohmann::json::array({vector.x(), vector.y(), vector.z()});
}

nlohmann::json value_json(const Quaternion& q) {
  return nlohmann::json::array({q.x, q.y, q.z, q.w});
}

nlohmann::json value_json(const Rotation& rotation) {
  const Eigen::Vector3d& axis = rotation.axis;
  return nlohmann::json::array({axis.x(), axis.y(), axis.z(), rotation.degrees});
}

nlohmann::json value_json(const Box& box) {
  return nlohmann::json::array({value_json(box.low), value_json(box.high)});
}

nlohmann::json value_json(const Lamp& lamp) {
  return nlohmann::json::array({lamp.azimuth, lamp.elevation, lamp.strength});
}

nlohmann::json value_json(Material material) { return to_string(material); }

nlohmann::json value_json(const Palette& palette) {
  nlohmann::json names = nlohmann::json::array();
  for (const Rgb& stop : palette.stops) names.push_back(color_name(stop));
  return names;
}

nlohmann::json value_json(const std::optional<UpAxis>& up) { return up ? to_string(*up) : "auto"; }

}  // namespace qjulia::tools
