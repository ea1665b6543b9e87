#pragma once
/// Factors that may make a small hole in the shape or a small body outside, between samples.

#include <optional>
#include <vector>

#include "fit/energy_names.hpp"
#include "fit/schedule.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia::fitting {

/// The centre of each factor, projected onto the slice, and six points |W| away from it along the
/// axes: seven a factor.
std::vector<Eigen::Vector3d> points_at_centers(const Map& map);

/// One-sided samples for poles inside the shape and roots outside, beyond the band: at their
/// centres and beside them.
struct MisplacedFactors {
  Samples samples;
  std::vector<std::size_t> factors;  ///< the number of each sample's factor, ascending
};

/// @param distances signed, of `points_at_centers`
MisplacedFactors misplaced_factors(const Map& map, const std::vector<double>& distances,
                                   const Level& level);

/// The map with each factor that does make a hole or a body (F at one of its samples has the wrong
/// sign) moved so far off the slice that F there reaches the sample's target. Nothing if there is
/// no such factor. Each is moved as if it were alone.
/// @param field F at the samples
std::optional<Map> lifted(const Map& map, const MisplacedFactors& misplaced,
                          const std::vector<double>& field);

}  // namespace qjulia::fitting
