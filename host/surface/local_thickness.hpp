#pragma once
/// How thick a shape is about each place of its surface.

#include <Eigen/Core>
#include <vector>

#include "qjulia/device.hpp"
#include "qjulia/progress.hpp"
#include "qjulia/rational_map.hpp"
#include "surface/grid.hpp"

namespace qjulia::surface {

/// A place just within the surface, and the radius of the largest ball in the shape that holds it
/// (its local thickness: Hildebrand and Rüegsegger 1997); map units.
struct ThicknessAt {
  Eigen::Vector3d x;
  double radius = 0;
};

/// Of the map's own shape (n = 1, without portals), at those points of the grid that are inside and
/// have a neighbour outside. Radii above `most` are `most`.
std::vector<ThicknessAt> local_thickness(const Device& device, const RationalMap& map,
                                         const Grid& grid, double most,
                                         const ProgressMonitor& monitor);

}  // namespace qjulia::surface
