#include "film/dive.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <numbers>

#include "qjulia/base/error.hpp"

namespace qjulia::film {
namespace {

using Eigen::Vector3d;

constexpr double kRadian = std::numbers::pi / 180;  // of a degree

/// The degrees by which a rotation turns to the left about `up`. @throws InputError where it tilts
/// that
double turn_about(const Vector3d& up, const Eigen::Matrix3d& rotation) {
  constexpr double kUpright = 1e-6;
  if ((rotation * up - up).norm() > kUpright) {
    throw InputError(
        "it tilts what stands upright, and a camera cannot roll; turn the portal's `rotation` "
        "about "
        "the up axis alone");
  }
  const Vector3d ahead = up.unitOrthogonal(), turned = rotation * ahead;
  return std::atan2(up.dot(ahead.cross(turned)), ahead.dot(turned)) / kRadian;
}

}  // namespace

Dive::Dive(const Map& map, std::size_t portal, UpAxis up) : up_(direction(up)) {
  const std::vector<Portal>& portals = map.layers.portals;
  if (portals.empty()) {
    throw InputError("the map has no portal to dive into; 'qjulia portals' plants some");
  }
  if (portal < 1 || portal > portals.size()) {
    throw InputError(fmt::format("there is no portal {}; give 1 to {}", portal, portals.size()));
  }
  const Portal& chosen = portals[portal - 1];
  constexpr double kLeastScale = 1.05;  // a loop would hardly move
  if (chosen.scale < kLeastScale) {
    throw InputError(fmt::format(
        "its `scale` is {:.4g}, so that its copy is not smaller than the set; give {} at least",
        chosen.scale, kLeastScale));
  }
  scale_ = chosen.scale;
  const Eigen::Matrix3d rotation = chosen.rotation.matrix();
  turn_ = -turn_about(up_, rotation);
  // x = d + s Rot (x − c). The matrix has an inverse: its eigenvalues are 1 − s times phases.
  const Eigen::Matrix3d linear = scale_ * rotation;
  const Vector3d point = (Eigen::Matrix3d::Identity() - linear).inverse() *
                         (chosen.destination - linear * chosen.center);
  const ShapeToMap& to_map = map.frame.shape_to_map;
  point_ = to_map.to_shape(point);
  const double away = (point - chosen.center).norm();
  constexpr double kLeastRoom = 0.05;  // of the radius
  if (!(chosen.radius - away >= kLeastRoom * chosen.radius)) {
    throw InputError(fmt::format(
        "its ball has a `radius` of {:.4g}, and the point to which copies on copies shrink lies "
        "{:.4g} from its `center`: what is about that point would be cut off; give a radius of "
        "{:.4g} or more in the map's file, where that leaves balls apart",
        chosen.radius, away, 1.5 * away));
  }
  room_ = (chosen.radius - away) / to_map.scale;
}

Camera Dive::placed(Camera camera, double aspect) const {
  constexpr double kAbove = 0.3;  // of half the picture's height
  if (camera.field_of_view == 0) {
    throw OptionError(
        "field_of_view",
        "with parallel rays (0) nothing comes nearer; give a number of degrees above 0");
  }
  const double tangent = std::tan(0.5 * camera.field_of_view * kRadian) / camera.zoom;
  if (!camera.distance) {
    camera.distance = scale_ * room_ / (tangent * std::hypot(aspect, 1 + kAbove));
  }
  if (!camera.look_at) camera.look_at = point_ - kAbove * tangent * *camera.distance * up_;
  return camera;
}

Camera Dive::moved(Camera first, double way) const {
  const double smaller = std::pow(scale_, -way);
  const Eigen::AngleAxisd turned(way * turn_ * kRadian, up_);
  first.look_at = point_ + smaller * (turned * (*first.look_at - point_));
  *first.distance *= smaller;
  first.azimuth += way * turn_;
  return first;
}

}  // namespace qjulia::film
