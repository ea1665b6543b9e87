#pragma once
/// The modulus of a quadratic map: kernels/quadratic_modulus.clh.

#include <cmath>

#include "qjulia/base/quaternion.hpp"
#include "qjulia/map/kinds/kind.hpp"

namespace qjulia {

/// F = S + ln |q² + c|.
struct QuadraticModulus {
  static constexpr const char* kName = "quadratic";
  static constexpr bool kTakesFactors = false;
  static constexpr int kFileVersion = 1;

  Quaternion c;  ///< map coordinates

  bool operator==(const QuadraticModulus&) const = default;
  template <class Self, class Visit>
  static void members(Self& self, const Visit& visit) {
    visit("c", self.c);
  }
  /// q and its image share a square: about as much as one factor.
  static double cost(const Dynamics& /*map*/) { return 1; }
  static constexpr bool kHasCubeBounds = false;
  static double degree(const Dynamics& /*map*/) { return 2; }
  /// The r of e^S (r² − |c|) = r.
  OuterBound outer_bound(const auto& map) const {
    const double scale = std::exp(map.log_scale);
    return {(1 + std::sqrt(1 + 4 * scale * scale * norm(c))) / (2 * scale), true};
  }
};

}  // namespace qjulia
