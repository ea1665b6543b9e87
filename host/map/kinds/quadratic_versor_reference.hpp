#pragma once
/// (q² + c) / |q² + c|.

#include "map/reference_math.hpp"

namespace qjulia::reference {

template <class T>
QuaternionOf<T> versor_of(const QuadraticVersor& kind, const MapOf<T>& /*map*/,
                          const QuaternionOf<T>& q) {
  return power<T>(quadratic(q, convert<T>(kind.c)), T(1)).versor;
}

}  // namespace qjulia::reference
