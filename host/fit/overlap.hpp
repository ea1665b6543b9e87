#pragma once
/// Intersection over union of a map's set with the shape, on a fixed coarse grid.

#include <vector>

#include "qjulia/device.hpp"
#include "qjulia/rational_map.hpp"
#include "qjulia/shape.hpp"

namespace qjulia {

class Overlap {
 public:
  Overlap(const Device& device, const Shape& shape, const SignedDistance& distance);

  /// IoU of {F_n < map.surface_level} and the inside of the shape, 0 … 1.
  double operator()(const RationalMap& map, int iterations) const;

 private:
  Device device_;
  std::vector<Quaternion> points_;
  std::vector<bool> inside_;
};

}  // namespace qjulia
