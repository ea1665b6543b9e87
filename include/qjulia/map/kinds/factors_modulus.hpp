#pragma once
/// The modulus of factors: host/map/kinds/factors_modulus.cpp, kernels/factors_modulus.clh.

#include "qjulia/map/kinds/kind.hpp"

namespace qjulia {

/// F = S + Σ a_k ln |q − c_k| over the map's factors.
struct FactorsModulus {
  static constexpr const char* kName = "factors";
  static constexpr bool kTakesFactors = true;
  static constexpr int kFileVersion = 1;  ///< the first version of map files that can hold it

  bool operator==(const FactorsModulus&) const = default;

  /// Calls `visit(name, member)` for each member that map files hold.
  template <class Self, class Visit>
  static void members(Self& /*self*/, const Visit& /*visit*/) {}

  /// What F costs at a point, in logarithms of distances to centres.
  static double cost(const Dynamics& map);
  /// Devices can bound F over cubes.
  static constexpr bool kHasCubeBounds = true;

  /// What F grows with, far out: F ≈ degree · ln |q|.
  static double degree(const Dynamics& map);
  /// Asked for maps whose degree is above 1.
  static OuterBound outer_bound(const Dynamics& map);
};

}  // namespace qjulia
