#pragma once
/// From the map that stages fitted to the one a user gets.

#include <string>
#include <vector>

#include "fit/sample_pool.hpp"
#include "qjulia/map.hpp"
#include "qjulia/shape.hpp"

namespace qjulia::fitting {

/// A map in distance units, given the shell that is wanted, calibrated, in the shape's units. Where
/// its origin is not inside, it stays without calibration. One that was finished before, and has
/// been polished since, is given its shell's thickness back. Where the set would not end near the
/// shape, far roots are left out and the sum of exponents is raised. If no sum that is tried will
/// do, the first map is kept, with a smaller `detail` if its set would be unbounded otherwise.
/// @param iou what the last stage reached, n = 1; below 0.9 a warning says where the error sits.
/// @param detail δ, fraction of the box's diagonal.
Map finish_map(const Device& device, Map map, double iou, const Shape& shape,
               const SamplePool& pool, double detail, std::vector<std::string>& warnings);

/// The mean distance of a finished map's surface (steepness 1) from the pool's surface points, to
/// first order, over the diagonal of the shape's box.
double mean_distance(const Device& device, const Map& map, const SamplePool& pool);

}  // namespace qjulia::fitting
