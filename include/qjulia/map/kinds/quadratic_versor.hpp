#pragma once
/// The versor of a quadratic map: kernels/quadratic_versor.clh.

#include "qjulia/base/quaternion.hpp"
#include "qjulia/map/kinds/kind.hpp"

namespace qjulia {

/// U = p · (q² + c) / |q² + c|.
struct QuadraticVersor {
  static constexpr const char* kName = "quadratic";
  static constexpr bool kTakesFactors = false;
  static constexpr int kFileVersion = 1;

  Quaternion c;  ///< map coordinates

  bool operator==(const QuadraticVersor&) const = default;
  template <class Self, class Visit>
  static void members(Self& self, const Visit& visit) {
    visit("c", self.c);
  }
  static double cost(const Dynamics& /*map*/) { return 4; }
  static constexpr bool kIsSmooth = true;
};

}  // namespace qjulia
