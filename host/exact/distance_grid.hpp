#pragma once
/// The grid of a mesh's signed distance.

#include <Eigen/Core>
#include <functional>
#include <span>
#include <stop_token>
#include <vector>

#include "qjulia/base/box.hpp"
#include "qjulia/map/modulus.hpp"

namespace qjulia::exact {

/// Signed distances of points, in the units of these.
using Distances = std::function<std::vector<double>(std::span<const Eigen::Vector3d>)>;

/// A grid of `resolution` cells along its longest side that holds `box` and a margin, its origin
/// and its step: nothing else of the modulus is set. Exact distances are taken at the centres of
/// all coarse cells, and at those of cells near the surface. @throws Interrupted.
DistanceModulus sampled_distance(const Distances& distances, const Box& box, int resolution,
                                 const std::stop_token& stop);

}  // namespace qjulia::exact
