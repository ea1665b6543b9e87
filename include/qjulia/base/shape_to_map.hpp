#pragma once
/// Coordinates of a map in terms of those of the shape it is made for.

#include <Eigen/Core>

#include "qjulia/base/box.hpp"

namespace qjulia {

/// Longest side of a fitted shape's box in map coordinates.
constexpr double kMapSide = 3;

/// x_map = scale · x_shape + translation.
struct ShapeToMap {
  double scale = 1;
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d to_map(const Eigen::Vector3d& x) const { return scale * x + translation; }
  Box to_map(const Box& box) const { return {to_map(box.low), to_map(box.high)}; }
  Eigen::Vector3d to_shape(const Eigen::Vector3d& x) const { return (x - translation) / scale; }
};

}  // namespace qjulia
