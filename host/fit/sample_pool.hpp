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

class SamplePool {
 public:
  /// Points on the surface, offset from it by up to two widths, and throughout the shape's
  /// surroundings. Distances are taken on the device, once.
  SamplePool(const Shape& shape, const SignedDistance& distance, std::uint64_t seed);

  const std::vector<SurfacePoint>& surface() const { return surface_; }
  const std::vector<DistancePoint>& near() const { return near_; }      ///< offset points
  const std::vector<DistancePoint>& around() const { return around_; }  ///< uniform in a box

  /// A stage's samples for the distance loss: half on the surface (target 0), 35 % within the
  /// band (target: the distance), the rest beyond it, one-sided at ± band. Weights sum to 1.
  Samples draw(const Phase& phase, Random& random) const;

 private:
  std::vector<SurfacePoint> surface_;
  std::vector<DistancePoint> near_;
  std::vector<DistancePoint> around_;
};

}  // namespace qjulia
