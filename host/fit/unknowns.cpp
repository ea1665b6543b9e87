#include <stdexcept>

#include "fit/evaluator.hpp"

namespace qjulia {

std::vector<double> to_unknowns(const RationalMap& map) {
  const std::size_t k = map.factors.size();
  std::vector<double> v(1 + 5 * k);
  v[0] = map.log_scale;
  for (std::size_t i = 0; i < k; ++i) {
    const auto& [center, exponent] = map.factors[i];
    v[1 + i] = exponent;
    v[1 + k + i] = center.x;
    v[1 + 2 * k + i] = center.y;
    v[1 + 3 * k + i] = center.z;
    v[1 + 4 * k + i] = center.w;
  }
  return v;
}

RationalMap with_unknowns(RationalMap map, const std::vector<double>& v) {
  const std::size_t k = map.factors.size();
  if (v.size() != 1 + 5 * k) throw std::logic_error("unknowns do not match the map's factors");
  map.log_scale = v[0];
  for (std::size_t i = 0; i < k; ++i) {
    map.factors[i] = {{v[1 + k + i], v[1 + 2 * k + i], v[1 + 3 * k + i], v[1 + 4 * k + i]},
                      v[1 + i]};
  }
  return map;
}

}  // namespace qjulia
