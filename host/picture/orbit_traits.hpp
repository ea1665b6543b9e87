#pragma once
/// What colours points of a set by their orbits (kernels/orbit_trait.cl).

#include <Eigen/Core>
#include <span>
#include <stop_token>
#include <vector>

#include "map/device_map.hpp"
#include "qjulia/picture/picture.hpp"

namespace qjulia::picture {

/// 0 … 1 for each point, map units.
/// @param widths of the balls that points stand for: one for all, or one for each.
/// @param material iterations, trap, groove or factor.
/// @throws OptionError naming `material` for factors of a map without; Interrupted
std::vector<float> orbit_traits(const map::DeviceMap& map,
                                const std::vector<Eigen::Vector3d>& points,
                                std::span<const double> widths, int iterations, Material material,
                                const std::stop_token& stop);

}  // namespace qjulia::picture
