#pragma once
/// Points about a shape with their signed distances, from which each stage draws its samples.

#include <stop_token>
#include <vector>

#include "base/random.hpp"
#include "fit/energy_names.hpp"
#include "fit/schedule.hpp"
#include "qjulia/mesh/shape.hpp"

namespace qjulia::fitting {

/// A point and its signed distance to the surface, map units.
struct DistancePoint {
  Eigen::Vector3d position;
  double distance;
};

struct SamplePool {
  std::vector<SurfacePoint> surface;
  std::vector<DistancePoint> near;    ///< offset from the surface along normals
  std::vector<DistancePoint> around;  ///< uniform in a cube about the shape
  std::vector<DistancePoint> deep{};  ///< uniform in the shape, away from its surface
  double inradius = 0;                ///< distance of the origin to the surface

  /// A stage's samples. For the distance loss, half on the surface (target 0), 35 % within the
  /// band (target: the distance), the rest beyond it, one-sided at ± band: a third near the
  /// surface, a third in the cube, a third deep in the shape; weights sum to 1 at a
  /// `band_weight` of 1. With an `off_slice_weight` there are 8 % more, within 0.9
  /// inradii of the origin or at |W| of 0.3 or more, one-sided at their distance from a sphere
  /// about the origin, at most ± band: inside it and outside.
  /// For the tanh loss seven eighths within the band, the rest beyond it, with their sides and
  /// target 0; either side's weights sum to ½.
  Samples draw(const Level& level, base::Random& random) const;
};

/// Distances are taken on the device, once for a fit. The pool is the same for the same seed,
/// numbers of `evaluations` that the fit may make (a short one draws few samples, and needs a small
/// pool) and of `samples` that its largest stage draws.
/// @param stop ends the work: Interrupted.
SamplePool make_sample_pool(const Shape& shape, const SignedDistance& distance, std::uint64_t seed,
                            int evaluations, int samples, const std::stop_token& stop = {});

/// The centres of level.samples³ equal cells of the cube of side 4 about a shape, with weights
/// that fall off as 1 / distance, either side's summing to ½ (Kim 2015).
/// @param stop ends the work: Interrupted.
Samples grid_samples(const Shape& shape, const SignedDistance& distance, const Level& level,
                     const std::stop_token& stop = {});

}  // namespace qjulia::fitting
