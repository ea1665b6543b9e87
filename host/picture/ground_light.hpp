#pragma once
/// The sky's light on the ground around the shape, which no camera changes.

#include <vector>

#include "picture/lights.hpp"
#include "picture/shading.hpp"

namespace qjulia::picture {

/// Each light stands for its part of the sky: its shadow is as soft as that part is wide.
/// @param maps each light's depth map. @param fineness as for lights.
GroundLight ground_light(const Device& device, const Scene& scene, const std::vector<Light>& sky,
                         const std::vector<std::vector<float>>& maps, double fineness);

}  // namespace qjulia::picture
