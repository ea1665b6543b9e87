#pragma once

#include <Eigen/Core>
#include <span>

namespace qjulia {

struct BoxDimension {
  double dimension;
  double error;  ///< standard error of the slope
  int sizes;
};

/// The box-counting dimension of a set of points, by boxes from 1/8 of the longest side down to the
/// last half that is at least `finest` wide, and 1/512.
BoxDimension box_dimension(std::span<const Eigen::Vector3f> points, double finest);

}  // namespace qjulia
