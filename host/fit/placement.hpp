#pragma once
/// Where the factors start.

#include "fit/evaluator.hpp"
#include "fit/sample_pool.hpp"
#include "qjulia/rational_map.hpp"

namespace qjulia::fitting {

/// Farthest-point placement: 60 % of the factors inside (roots), the rest outside (poles), spaced
/// in proportion to their distance to the surface, W = 0.02 + ½ distance. Exponents by least
/// squares of F_1 against signed distance, each kept to its sign.
/// @throws InputError when the mesh has too little inside or around to place factors in.
RationalMap place_factors(const EvaluatorFactory& make_evaluator, const SamplePool& pool,
                          int factors, std::uint64_t seed);

/// The largest number of factors that there is room for, by the pool's points.
int most_factors(const SamplePool& pool);

}  // namespace qjulia::fitting
