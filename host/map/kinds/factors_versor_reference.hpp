#pragma once
/// Π (q − c_k)^{a_k} / |q − c_k|^{a_k}.

#include "map/reference_math.hpp"

namespace qjulia::reference {

template <class T>
QuaternionOf<T> versor_of(const FactorsVersor& /*kind*/, const MapOf<T>& map,
                          const QuaternionOf<T>& q) {
  QuaternionOf<T> u{T(1), T(0), T(0), T(0)};
  for (const auto& [c, a] : map.factors) {
    u = product(u, power<T>({q.x - c.x, q.y - c.y, q.z - c.z, q.w - c.w}, a).versor);
  }
  return u;
}

}  // namespace qjulia::reference
