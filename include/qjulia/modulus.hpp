#pragma once
/// The modulus of a map R(q) = e^F(q) U(q): how far from the origin each image lies. F has several
/// kinds.
///
/// A kind is a struct here with the members that a map file and a device hold, its functions in
/// host/map/NAME_modulus.cpp, and its field on the device in kernels/NAME_modulus.clh.

#include <variant>

#include "qjulia/quaternion.hpp"

namespace qjulia {

struct RationalMap;

/// A radius beyond which F > ln |q| for certain, map units.
struct OuterBound {
  double radius = 0;
  bool is_sharp = false;  ///< no smaller radius would do
};

/// F = S + Σ a_k ln |q − c_k| over the map's factors.
struct FactorsModulus {
  static constexpr const char* kName = "factors";
  static constexpr bool kTakesFactors = true;

  bool operator==(const FactorsModulus&) const = default;

  /// Calls `visit(name, member)` for each member that map files hold.
  template <class Self, class Visit>
  static void members(Self& /*self*/, const Visit& /*visit*/) {}

  /// What F grows with, far out: F ≈ degree · ln |q|.
  static double degree(const RationalMap& map);
  /// Asked for maps whose degree is above 1.
  static OuterBound outer_bound(const RationalMap& map);
};

/// F = S + ln |q² + c|.
struct QuadraticModulus {
  static constexpr const char* kName = "quadratic";
  static constexpr bool kTakesFactors = false;

  Quaternion c;  ///< map coordinates

  bool operator==(const QuadraticModulus&) const = default;
  template <class Self, class Visit>
  static void members(Self& self, const Visit& visit) {
    visit("c", self.c);
  }
  double degree(const RationalMap& map) const;
  OuterBound outer_bound(const RationalMap& map) const;
};

using Modulus = std::variant<FactorsModulus, QuadraticModulus>;

}  // namespace qjulia
