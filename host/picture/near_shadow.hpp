#pragma once
/// Shadows shorter than a few texels of the key light's map.

#include <cstdint>
#include <vector>

#include "picture/depth_source.hpp"
#include "picture/lights.hpp"
#include "picture/shading.hpp"

namespace qjulia::picture {

/// For each pixel of a strip, row by row: from 255 where something nearby keeps the key light off
/// what is seen at its middle and around it, down to 0 where nothing does. In a close-up a texel of
/// the light's map is wider than a pixel. Shadows shorter than a few texels are missing from the
/// map, and longer ones would be detached from what throws them; rays show the missing parts. Empty
/// where texels are fine enough.
std::vector<std::uint8_t> near_shadow(DepthSource& source, const View& view, const Light& key,
                                      const Strip& strip);

/// The narrowest penumbra of the key light's map, texels: wide texels would show in the edges of a
/// narrower penumbra.
double narrowest_penumbra(const View& view, const Light& key);

}  // namespace qjulia::picture
