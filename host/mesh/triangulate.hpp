#pragma once
/// Polygons cut into triangles.

#include <functional>
#include <span>

#include "qjulia/mesh/mesh.hpp"

namespace qjulia::shape {

/// Replaces a fan about a polygon's first corner by triangles that cover the polygon, where the fan
/// does not: by ear clipping (Meisters 1975) in the coordinate plane that the polygon faces most,
/// with exact orientations. Corners in one line are kept, and so are polygons with holes that
/// bridges join to the boundary.
/// @param vertices with coordinates of single precision. @param fan its n − 2 triangles.
/// @param poll called now and then; may throw.
/// @return false when the polygon has no area, crosses itself, or is so intricate that it took too
///   long; some of its triangles then overlap.
bool triangulate(std::span<const Eigen::Vector3d> vertices, std::span<Triangle> fan,
                 const std::function<void()>& poll);

}  // namespace qjulia::shape
