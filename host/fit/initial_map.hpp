#pragma once
/// A fit that starts from a map in place of factors placed by its own rule.

#include "fit/sample_pool.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/map/map.hpp"
#include "qjulia/mesh/shape.hpp"

namespace qjulia::fitting {

/// The map as stages take it: in the map coordinates of `shape`, on the slice W = 0, without
/// layers, and with an F_1 that is about the distance to its surface F_1 = 0.
/// @param given where it lies in shape units, its own shape_to_map says.
/// @throws OptionError naming `initial` where its field does not change about the shape's surface.
Map started_from(const Device& device, const Map& given, const Shape& shape,
                 const SamplePool& pool);

}  // namespace qjulia::fitting
