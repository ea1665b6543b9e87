#pragma once
/// Points about a shape with their signed distances, from which each stage draws its samples.

#include <vector>

#include "fit/random.hpp"
#include "fit/samples.hpp"
#include "fit/schedule.hpp"
#include "qjulia/shape.hpp"

namespace qjulia {

/// A point and its signed distance to the surface, map units.
struct DistancePoint {
  Eigen::Vector3d position;
  double distance;
};

struct SamplePool {
  std::vector<SurfacePoint> surface;
  std::vector<DistancePoint> near;    ///< offset from the surface along normals
  std::vector<DistancePoint> around;  ///< uniform in a box about the shape

  /// A stage's samples for the distance loss: half on the surface (target 0), 35 % within the
  /// band (target: the distance), the rest beyond it, one-sided at ± band. Weights sum to 1.
  Samples draw(const Phase& phase, Random& random) const;
};

/// Distances are taken on the device, once for a fit. The same for the same seed and number of
/// `evaluations` that the fit may make: a short one draws few samples, and needs a small pool.
SamplePool make_sample_pool(const Shape& shape, const SignedDistance& distance, std::uint64_t seed,
                            int evaluations);

}  // namespace qjulia
