#pragma once
/// Shadows that are thrown over less than a few texels of the key light's map.

#include <cstdint>
#include <vector>

#include "picture/depth_source.hpp"
#include "picture/lights.hpp"
#include "picture/shading.hpp"

namespace qjulia::picture {

/// For each pixel of a strip, row by row: 255 where something nearby keeps the key light off what
/// is seen at its middle and around, down to 0 where nothing does. In a close-up a texel of the
/// light's map is wider than a pixel, and what throws a shadow over less than a few texels is not
/// in it, so that shadows would be apart from what throws them. Rays show these. Empty where texels
/// are fine enough.
std::vector<std::uint8_t> near_shadow(DepthSource& source, const View& view, const Light& key,
                                      const Strip& strip);

/// The narrowest penumbra of the key light's map, texels: where these are wide, they show in the
/// edges of narrower ones.
double narrowest_penumbra(const View& view, const Light& key);

}  // namespace qjulia::picture
