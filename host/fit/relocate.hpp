#pragma once
/// Moving factors that matter little to where the fit is worst.

#include "base/random.hpp"
#include "fit/energy_names.hpp"

namespace qjulia::fitting {

/// Removes the `count` factors whose loss costs least (a² over the diagonal of the inverse normal
/// matrix of the exponents: optimal brain surgeon, Hassibi and Stork 1993) and puts as many new
/// ones where, of candidates drawn about samples with large residuals, the energy can fall most
/// (orthogonal matching pursuit). F_1 is linear in the exponents, which are refitted after each
/// half. New factors take the places of those removed; the rest keep theirs.
/// @param samples those of `evaluator`, for the distance loss.
Map relocate_factors(Evaluator& evaluator, const Samples& samples, const Map& map, int count,
                     base::Random& random);

}  // namespace qjulia::fitting
