#pragma once
/// What colours points of a set by their orbits (kernels/orbit_trait.cl).

#include <Eigen/Core>
#include <stop_token>
#include <vector>

#include "map/device_map.hpp"
#include "qjulia/picture.hpp"

namespace qjulia::picture {

/// 0 … 1 for each point, map units. @param material iterations or trap.
/// @throws Interrupted
std::vector<float> orbit_traits(const map::DeviceMap& map,
                                const std::vector<Eigen::Vector3d>& points, int iterations,
                                Material material, const std::stop_token& stop);

}  // namespace qjulia::picture
