#pragma once
/// The versor of factors: kernels/factors_versor.clh.

#include "qjulia/map/kinds/kind.hpp"

namespace qjulia {

/// U = p · Π (q − c_k)^{a_k} / |q − c_k|^{a_k} over the map's factors.
struct FactorsVersor {
  static constexpr const char* kName = "factors";
  static constexpr bool kTakesFactors = true;
  static constexpr int kFileVersion = 1;  ///< the first version of map files that can hold it

  bool operator==(const FactorsVersor&) const = default;

  /// Calls `visit(name, member)` for each member that map files hold.
  template <class Self, class Visit>
  static void members(Self& /*self*/, const Visit& /*visit*/) {}

  /// What U costs at a point, in logarithms of distances to centres.
  static double cost(const Dynamics& map);
  /// Whether iterates between those of a lattice may be interpolated.
  static constexpr bool kIsSmooth = true;
};

}  // namespace qjulia
