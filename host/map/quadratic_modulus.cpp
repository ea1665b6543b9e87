#include <cmath>

#include "qjulia/rational_map.hpp"

namespace qjulia {

/// The r of e^S (r² − |c|) = r.
OuterBound QuadraticModulus::outer_bound(const RationalMap& map) const {
  const double scale = std::exp(map.log_scale);
  return {(1 + std::sqrt(1 + 4 * scale * scale * norm(c))) / (2 * scale), true};
}

}  // namespace qjulia
