#pragma once
/// Vertices of a mesh on the edges of a grid.

#include <Eigen/Core>
#include <algorithm>
#include <limits>

#include "lattice/grid.hpp"

namespace qjulia::surface {

/// Vertices stay at least so many steps away from grid points, so that no two of them coincide.
constexpr float kVertexMargin = 0.01F;

/// How differences F_n − L are scaled before they are interpolated.
struct DifferenceScale {
  /// Differences are clamped to ± this, for fields that jump.
  double reach = std::numeric_limits<double>::infinity();
  /// Differences above the level are divided by this, because the field is so much steeper there.
  double steepness = 1;
};

/// A vertex on the grid edge that leads from a point one step along an axis.
struct EdgeVertex {
  Eigen::Vector3i point = Eigen::Vector3i::Zero();
  int axis = 0;
  float at = 0;  ///< 0 at `point`, 1 at the edge's other end
  /// Scaled F_n − L at `point` and at the other end. It is below 0 at the end that is inside.
  float at_start = 0, at_end = 0;

  /// Moves the vertex to `place`, or as near as kVertexMargin allows. NaN counts as 0.
  void put(float place) {
    at = place >= kVertexMargin ? std::min(place, 1 - kVertexMargin) : kVertexMargin;
  }

  /// The place on the edge, map coordinates.
  Eigen::Vector3d on(const Grid& grid) const {
    return grid.at(point.cast<double>() + double{at} * Eigen::Vector3d::Unit(axis));
  }
};

}  // namespace qjulia::surface
