#pragma once
/// The meaning of the words for detail, such as "smooth", for an existing map.

#include <stop_token>

#include "qjulia/base/detail_choice.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia {

/// The detail that a word asks for, for `with_detail` and MapKnobs: chosen for the map's own shape,
/// F_1 < L without its portals, as it is on a grid of 128 cells. Takes about as long as its surface
/// at n = 1.
/// @throws InputError when the map cannot have another detail; OptionError naming `detail` when its
///   shape is empty; Interrupted.
double detail_for(const Device& device, const Map& map, DetailWord word,
                  const std::stop_token& stop = {});

}  // namespace qjulia
