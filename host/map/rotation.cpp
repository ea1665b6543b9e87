#include "qjulia/base/rotation.hpp"

#include <Eigen/Geometry>
#include <numbers>

namespace qjulia {

namespace {

constexpr double kDegree = std::numbers::pi / 180;

}  // namespace

Eigen::Matrix3d Rotation::matrix() const {
  return Eigen::AngleAxisd(degrees * kDegree, axis.normalized()).toRotationMatrix();
}

Rotation Rotation::of(const Eigen::Matrix3d& matrix) {
  const Eigen::AngleAxisd turn(matrix);
  return {turn.axis(), turn.angle() / kDegree};
}

}  // namespace qjulia
