#pragma once
/// Σ a_k ln |q − c_k|.

#include "map/reference_math.hpp"

namespace qjulia::reference {

template <class T>
T modulus_of(const FactorsModulus& /*kind*/, const MapOf<T>& map, const QuaternionOf<T>& q) {
  T sum(0);
  for (const auto& [c, a] : map.factors) {
    sum += power<T>({q.x - c.x, q.y - c.y, q.z - c.z, q.w - c.w}, a).log_norm;
  }
  return sum;
}

}  // namespace qjulia::reference
