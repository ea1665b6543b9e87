#pragma once
/// What kinds of modulus and versor have in common.

namespace qjulia {

struct Dynamics;

/// A radius beyond which F > ln |q| for certain, map units.
struct OuterBound {
  double radius = 0;
  bool is_sharp = false;  ///< no smaller radius would do
};

}  // namespace qjulia
