#pragma once
/// Factors of two maps paired, and what lies between them.

#include <vector>

#include "qjulia/map/map.hpp"
#include "qjulia/morph/morph.hpp"

namespace qjulia::morph {

/// A factor on its way. One that only one of the maps has stays at its place.
struct MovingFactor {
  Factor from, to;  ///< centres less the slice
};

struct Matching {
  std::vector<MovingFactor> factors;  ///< in the product's order
  MorphPairs pairs;
};

/// Pairs so that the least is moved: a pair costs ½ (|a| + |b|) |c_a − c_b|² + ρ² (a − b)², with
/// exponents over the mean of their map, and ρ a sixth of the shapes' side; what is left over costs
/// ρ² a². The order is the first map's; a factor of the second one alone follows the one that it
/// follows there.
Matching matched(const Dynamics& from, const Dynamics& to);

}  // namespace qjulia::morph
