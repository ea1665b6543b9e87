#pragma once
/// Oriented points, as scanners give them, as a surface of small polygons.

#include <Eigen/Core>
#include <span>
#include <stop_token>

#include "qjulia/mesh/mesh.hpp"

namespace qjulia::shape {

/// A polygon for each point: the part of the plane through it and across its normal that is nearer
/// to this point than to any of its neighbours. Together they tile the surface that the points were
/// taken from. Its winding numbers are those of the points as dipoles, each as strong as its cell
/// is large (Barill et al. 2018), and distances to it are distances to the surface and not to
/// points. At the border of the points, cells extend about as far from them as points are from each
/// other.
///
/// If the normals of two neighbours are within 60 degrees, their cells meet half-way between their
/// projections into the plane, so that noise across a surface does not count its area twice. If
/// they are within 107 degrees, as at a sharp edge, the cell ends at the neighbour's plane. Other
/// neighbours are ignored, so that thin plates keep both sides.
///
/// O(points · log points). @param points finite, no two equal. @param normals one for each, of
/// length 1. @throws Interrupted
TriangleMesh point_cells(std::span<const Eigen::Vector3d> points,
                         std::span<const Eigen::Vector3d> normals, const std::stop_token& stop);

}  // namespace qjulia::shape
