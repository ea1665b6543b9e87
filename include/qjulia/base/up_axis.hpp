#pragma once
/// Which way a shape stands.

#include <Eigen/Core>
#include <optional>
#include <string_view>

namespace qjulia {

/// The direction of a shape's coordinates that points up.
enum class UpAxis { x, y, z, minus_x, minus_y, minus_z };

/// Where nothing else is known: what .obj files mostly have.
constexpr UpAxis kDefaultUp = UpAxis::y;

/// "x", "-x" and so on.
const char* to_string(UpAxis axis);
/// The direction of that name, if there is one.
std::optional<UpAxis> up_axis_named(std::string_view name);

/// The unit vector.
Eigen::Vector3d direction(UpAxis axis);
/// 0, 1 or 2, whichever way it points.
int axis_number(UpAxis axis);

/// The rotation by right angles that brings one direction to another. Its numbers are 0, 1 and −1.
Eigen::Matrix3d quarter_turns(UpAxis from, UpAxis to);

}  // namespace qjulia
