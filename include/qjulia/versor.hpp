#pragma once
/// The versor of a map R(q) = e^F(q) U(q): in which direction from the origin each image lies. U, a
/// unit quaternion, has several kinds.
///
/// A kind is a struct here with the members that a map file and a device hold, and its field on the
/// device in kernels/NAME_versor.clh.

#include <variant>

#include "qjulia/quaternion.hpp"

namespace qjulia {

/// U = p · Π (q − c_k)^{a_k} / |q − c_k|^{a_k} over the map's factors.
struct FactorsVersor {
  static constexpr const char* kName = "factors";
  static constexpr bool kTakesFactors = true;
  static constexpr int kFileVersion = 1;  ///< of map files that can hold it

  bool operator==(const FactorsVersor&) const = default;

  /// Calls `visit(name, member)` for each member that map files hold.
  template <class Self, class Visit>
  static void members(Self& /*self*/, const Visit& /*visit*/) {}
};

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
};

using Versor = std::variant<FactorsVersor, QuadraticVersor>;

}  // namespace qjulia
