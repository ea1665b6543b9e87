#pragma once
/// Where the factors start.

#include "fit/energy_names.hpp"
#include "fit/sample_pool.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia::fitting {

/// Farthest-point placement: 60 % of the factors inside (roots), the rest outside (poles), spaced
/// in proportion to their distance to the surface, W = 0.02 + ½ distance. Exponents by least
/// squares of F_1 against signed distance, each kept to its sign.
/// @throws InputError when the mesh has too little inside or around to place factors in.
Map place_factors(const EvaluatorFactory& make_evaluator, const SamplePool& pool, int factors,
                  std::uint64_t seed);

/// The start of Kim 2015: point charges on the surface that make the shape's electrostatic field.
/// Centres on the surface, chosen one by one: of candidates there, the one whose field 1 / r
/// correlates best with what is left of a conductor's potential (1 on the surface, harmonic
/// outside), all charges refitted after each (orthogonal matching pursuit). Charges become
/// exponents: positive ones roots, first, negative ones poles. The potential is found by the method
/// of fundamental solutions, with sources inside the shape. Log scale and a common factor on the
/// exponents are regressed to signed distance.
/// @throws InputError when the pool has too few points inside or outside.
Map place_monopoles(const SamplePool& pool, int factors, std::uint64_t seed);

/// The largest number of factors that there is room for, by the pool's points.
int most_factors(const SamplePool& pool);

}  // namespace qjulia::fitting
