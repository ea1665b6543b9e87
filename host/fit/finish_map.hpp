#pragma once
/// From the map that stages fitted to the one a user gets.

#include <string>
#include <vector>

#include "fit/sample_pool.hpp"
#include "qjulia/map/map.hpp"
#include "qjulia/mesh/shape.hpp"

namespace qjulia::fitting {

/// A map in distance units, given the shell that is wanted, calibrated, in the shape's units. Where
/// its origin is not inside, it stays without calibration. One that was finished before, and has
/// been polished since, is given its shell's thickness back. Where the set would not end near the
/// shape, far roots are left out and the sum of exponents is raised. If no sum that is tried will
/// do, the first map is kept, with a smaller `detail` if its set would be unbounded otherwise.
/// @param detail δ, fraction of the box's diagonal.
Map finish_map(const Device& device, Map map, const Shape& shape, const SamplePool& pool,
               double detail, std::vector<std::string>& warnings);

/// A warning that says how poor the fit is and where it is farthest from the surface; empty if the
/// IoU is 0.9 or more. @param map finished. @param iou its own, at n = 1.
std::string poor_fit(const Device& device, const Map& map, double iou, const SamplePool& pool);

/// The mean distance of the pool's surface points from a finished map's surface, to first order,
/// over the diagonal of the shape's box.
double mean_distance(const Device& device, const Map& map, const SamplePool& pool);

}  // namespace qjulia::fitting
