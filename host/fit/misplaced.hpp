#pragma once
/// Factors that may make a small hole in the shape or a small body outside, between samples.

#include <optional>
#include <vector>

#include "fit/samples.hpp"
#include "fit/schedule.hpp"
#include "qjulia/rational_map.hpp"

namespace qjulia::fitting {

/// The centre of each factor, projected onto the slice, and the six points |W| beside it along the
/// axes; seven a factor.
std::vector<Eigen::Vector3d> points_at_centers(const RationalMap& map);

/// One-sided samples at poles inside the shape and roots outside, beyond the band.
struct MisplacedFactors {
  Samples samples;
  std::vector<std::size_t> factors;  ///< each sample's, ascending
};

/// @param distances signed, of `points_at_centers`
MisplacedFactors misplaced_factors(const RationalMap& map, const std::vector<double>& distances,
                                   const Level& level);

/// The map with those factors that do make a hole or a body as far off the slice as brings F at
/// their samples to its target; nothing if there are none.
/// @param field F at the samples
std::optional<RationalMap> lifted(const RationalMap& map, const MisplacedFactors& misplaced,
                                  const std::vector<double>& field);

}  // namespace qjulia::fitting
