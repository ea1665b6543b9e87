#pragma once
/// The grid of a mesh's signed distance.

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <span>
#include <stop_token>
#include <vector>

#include "qjulia/box.hpp"
#include "qjulia/distance_grid.hpp"

namespace qjulia::fitting {

/// Cell (0, 0, 0) begins at `origin`; any units.
struct PlacedGrid {
  std::shared_ptr<const DistanceGrid> grid;
  Eigen::Vector3d origin;
  double step;
};

/// Signed distances of points, in the units of these.
using Distances = std::function<std::vector<double>(std::span<const Eigen::Vector3d>)>;

/// A grid of `resolution` cells along its longest side that holds `box` and a margin. Exact
/// distances are taken at the centres of all coarse cells, and at those of cells near the surface.
/// @throws Interrupted.
PlacedGrid sampled_distance(const Distances& distances, const Box& box, int resolution,
                            const std::stop_token& stop);

}  // namespace qjulia::fitting
