#pragma once
/// A turn of space.

#include <Eigen/Core>

namespace qjulia {

/// A turn about an axis through the origin.
struct Rotation {
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  ///< its length may be any but 0
  double degrees = 0;

  bool operator==(const Rotation&) const = default;
  Eigen::Matrix3d matrix() const;
  /// The turn of that matrix.
  static Rotation of(const Eigen::Matrix3d& matrix);
};

}  // namespace qjulia
