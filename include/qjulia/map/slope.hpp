#pragma once
/// How steep a map's F_1 is about one of its levels.

#include <optional>

#include "qjulia/base/box.hpp"
#include "qjulia/map/field.hpp"

namespace qjulia {

/// Nearly the greatest ‖∇F_1‖, by the three coordinates of a slice, where F_1 = level: the 95th
/// percentile over 4,096 points that are scattered in the box and led there by Newton's steps along
/// the gradient. Nothing where none of them gets there. A level above it by f is at least
/// f / slope away, map units, but for the neighbourhoods of poles.
/// @param box map coordinates.
/// @throws OptionError naming `slice` or `level` where it is not finite; what `Field` throws, where
///   the box is not.
std::optional<double> steepest_slope(const Field& field, double slice, double level,
                                     const Box& box);

}  // namespace qjulia
