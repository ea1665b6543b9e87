#pragma once
/// Vertices of a mesh on the edges of a grid.

#include <Eigen/Core>
#include <algorithm>
#include <limits>

#include "surface/grid.hpp"

namespace qjulia::surface {

/// Vertices keep this far from grid points, in steps: no two of them coincide.
constexpr float kVertexMargin = 0.01F;

/// How differences F_n − L are made ready for interpolation.
struct DifferenceScale {
  /// They are clamped to ± this: for fields that jump.
  double reach = std::numeric_limits<double>::infinity();
  /// Of the field above the level; divided by it, it interpolates as well as below.
  double steepness = 1;
};

/// A vertex on the grid edge that leads from a point one step along an axis.
struct EdgeVertex {
  Eigen::Vector3i point = Eigen::Vector3i::Zero();
  int axis = 0;
  float at = 0;  ///< 0 at `point`, 1 at the edge's other end
  /// F_n − L by its scale at `point` and at the other end: the one that is inside is below 0.
  float at_start = 0, at_end = 0;

  /// Moves it there, or as near as its margin allows; near `point` when that is not a number.
  void put(float place) {
    at = place >= kVertexMargin ? std::min(place, 1 - kVertexMargin) : kVertexMargin;
  }

  /// The place on the edge, map coordinates.
  Eigen::Vector3d on(const Grid& grid) const {
    return grid.at(point.cast<double>() + double{at} * Eigen::Vector3d::Unit(axis));
  }
};

}  // namespace qjulia::surface
