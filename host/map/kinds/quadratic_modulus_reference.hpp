#pragma once
/// ln |q² + c|.

#include "map/reference_math.hpp"

namespace qjulia::reference {

template <class T>
T modulus_of(const QuadraticModulus& kind, const MapOf<T>& /*map*/, const QuaternionOf<T>& q) {
  return power<T>(quadratic(q, convert<T>(kind.c)), T(1)).log_norm;
}

}  // namespace qjulia::reference
