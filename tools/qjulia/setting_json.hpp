#pragma once
/// Values of settings as JSON, for provenance.

#include <nlohmann/json.hpp>
#include <optional>
#include <type_traits>

#include "qjulia/box.hpp"
#include "qjulia/picture.hpp"
#include "qjulia/quaternion.hpp"
#include "qjulia/rotation.hpp"

namespace qjulia::tools {

template <class Number>
requires std::is_arithmetic_v<Number> nlohmann::json value_json(Number number) { return number; }

nlohmann::json value_json(const Eigen::Vector3d& vector);
nlohmann::json value_json(const Quaternion& quaternion);
nlohmann::json value_json(const Rotation& rotation);  ///< axis and degrees
nlohmann::json value_json(const Box& box);            ///< low and high corner
nlohmann::json value_json(const Lamp& lamp);
nlohmann::json value_json(Material material);
nlohmann::json value_json(const Palette& palette);           ///< the stops
nlohmann::json value_json(const std::optional<UpAxis>& up);  ///< "auto" where it is not given

/// Null where it is not given.
template <class Value>
nlohmann::json value_json(const std::optional<Value>& value) {
  return value ? value_json(*value) : nlohmann::json();
}

}  // namespace qjulia::tools
