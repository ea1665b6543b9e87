#pragma once
/// The kernels' elementary functions on arrays, beside the host's.

#include <cstdint>
#include <vector>

#include "qjulia/device/device.hpp"

namespace qjulia::check {

/// Functions of lane_math_probe.cl by their numbers there.
enum class LaneFunction : std::int32_t { log2, exp, tanh, angle, sine, cosine, rsqrt, sum };

/// The host's, in double precision. `angle` alone uses `y`: it is that of the point (y, x), x ≥ 0,
/// in [0, π]. Not a number for `sum`, which adds lanes up.
double on_host(LaneFunction function, double x, double y);

/// The device's, at one lane width and precision.
class LaneProbe {
 public:
  LaneProbe(const Device& device, int width, Precision precision);

  /// The function at each x and y, whose number is a multiple of the width.
  std::vector<double> operator()(LaneFunction function, const std::vector<double>& x,
                                 const std::vector<double>& y) const;

  /// x as the device sees it.
  double rounded(double x) const;

 private:
  Device device_;
  int width_;
  Precision precision_;
};

}  // namespace qjulia::check
