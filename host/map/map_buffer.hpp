#pragma once
/// A rational map in a device buffer, laid out as shared/map_layout.h says.

#include <span>
#include <vector>

#include "device/context.hpp"
#include "qjulia/field.hpp"
#include "qjulia/rational_map.hpp"

namespace qjulia {

/// Factors in the buffer: a quadratic map has a neutral one there.
std::size_t packed_factors(const RationalMap& map);

/// The buffer's reals: header, then the component arrays. QJ_MAP_SIZE(packed_factors) of them.
std::vector<double> pack_map(const RationalMap& map, const StopRadii& stops);

/// `map` on the device, for kernels that take (map, factors).
device::RealBuffer upload_map(device::Context& context, const RationalMap& map,
                              const StopRadii& stops, Precision precision);

}  // namespace qjulia
