#pragma once
#include <cmath>
#include <numbers>
#include <vector>

#include "qjulia/base/quaternion.hpp"

namespace qjulia::map {

/// `count` unit quaternions spread evenly over the 4-D unit sphere; always the same ones.
inline std::vector<Quaternion> sphere_directions(std::size_t count) {
  // The additive recurrence of Roberts ("The unreasonable effectiveness of quasirandom sequences",
  // 2018) in three dimensions, g the root of g^4 = g + 1, mapped to the sphere as Shoemake
  // ("Uniform random rotations", 1992) does.
  constexpr double kRoot = 1.2207440846057596;
  constexpr double kTurn = 2 * std::numbers::pi;
  std::vector<Quaternion> directions(count);
  for (std::size_t i = 0; i < count; ++i) {
    double whole = 0;
    const auto n = static_cast<double>(i + 1);
    const double u = std::modf(0.5 + n / kRoot, &whole);
    const double a = kTurn * std::modf(0.5 + n / (kRoot * kRoot), &whole);
    const double b = kTurn * std::modf(0.5 + n / (kRoot * kRoot * kRoot), &whole);
    const double s = std::sqrt(1 - u);
    const double c = std::sqrt(u);
    directions[i] = {s * std::sin(a), s * std::cos(a), c * std::sin(b), c * std::cos(b)};
  }
  return directions;
}

}  // namespace qjulia::map
