#pragma once
/// The sRGB encoding of linear light (IEC 61966-2-1).

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace qjulia::base {

inline double srgb_decoded(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

inline double srgb_encoded(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

/// The nearest of 256 steps of 0 … 1; what is not a number is 0.
inline std::uint8_t byte_of(double share) {
  constexpr double kMost = 255;
  return static_cast<std::uint8_t>(
      std::lround(std::isnan(share) ? 0 : kMost * std::clamp(share, 0.0, 1.0)));
}

}  // namespace qjulia::base
