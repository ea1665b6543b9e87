#pragma once
/// How far kernels of a tree of triangles walk it: the same walk on the host, counted.

#include <array>
#include <span>

#include "mesh/bvh.hpp"

namespace qjulia::shape {

/// Boxes (or dipoles) and triangles that a work-item looked at, for all its points at once.
struct TreeWalk {
  double boxes = 0;
  double triangles = 0;
};

/// What signed_distance.cl's nearest_distance looks at for points that one work-item carries.
TreeWalk nearest_walk(const Bvh& tree, std::span<const std::array<double, 3>> points);
/// What its winding_number looks at for these points.
TreeWalk winding_walk(const Bvh& tree, std::span<const std::array<double, 3>> points);

/// Slots of a point: additions, multiplications, minima and maxima of signed_distance.cl, which
/// all take the units of multiply-adds.
constexpr double kBoxSlots = 6 + 6 + 3;  ///< differences, minima and maxima, a square
constexpr double kTriangleSlots =
    6 + 3 * 14 + 9 + 3 + 4;  ///< offsets, edges, sides, height, minima
constexpr double kDipoleSlots = 3 + 3 + 1 + 3 + 4;
constexpr double kAngleSlots = 3 + 6 + 9 + 3 + 3 + 14 + 10;

}  // namespace qjulia::shape
