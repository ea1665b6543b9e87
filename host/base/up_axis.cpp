#include "qjulia/base/up_axis.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>

namespace qjulia {
namespace {

constexpr std::array kNames{"x", "y", "z", "-x", "-y", "-z"};  // by UpAxis

}  // namespace

const char* to_string(UpAxis axis) { return kNames.at(static_cast<std::size_t>(axis)); }

std::optional<UpAxis> up_axis_named(std::string_view name) {
  const auto* const found = std::ranges::find(kNames, name);
  if (found == kNames.end()) return std::nullopt;
  return static_cast<UpAxis>(found - kNames.begin());
}

int axis_number(UpAxis axis) { return static_cast<int>(axis) % 3; }

Eigen::Vector3d direction(UpAxis axis) {
  return (axis < UpAxis::minus_x ? 1 : -1) * Eigen::Vector3d::Unit(axis_number(axis));
}

Eigen::Matrix3d quarter_turns(UpAxis from, UpAxis to) {
  const Eigen::Vector3d a = direction(from), b = direction(to);
  if (from == to) return Eigen::Matrix3d::Identity();
  if (a == -b) {
    const Eigen::Vector3d still = Eigen::Vector3d::Unit((axis_number(from) + 1) % 3);
    return 2 * still * still.transpose() - Eigen::Matrix3d::Identity();
  }
  const Eigen::Vector3d still = a.cross(b);
  return b * a.transpose() - a * b.transpose() + still * still.transpose();
}

}  // namespace qjulia
