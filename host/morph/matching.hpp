#pragma once
/// Factors of two maps paired, and what lies between them.

#include <stop_token>
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
/// follows there. @throws InputError for more than kMostMorphFactors factors; Interrupted.
Matching matched(const Dynamics& from, const Dynamics& to, const std::stop_token& stop = {});

}  // namespace qjulia::morph
