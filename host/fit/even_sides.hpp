#pragma once
/// Which side of the slice each centre lies on: what F₁ on the slice leaves open.

#include "qjulia/rational_map.hpp"

namespace qjulia::fitting {

/// How much the fate of an image depends on its direction: the mean over directions of the 4-D
/// space of |ln ρ|. ρ is the radius of {F₁ < L} that way over its median, at least ½ and at most 2.
double unevenness(const RationalMap& map);

/// Moves centres to the other side of the slice, W to 2 slice − W, where that makes the map less
/// uneven. F₁ on the slice knows only their distance from it and stays the same; the iterated set
/// comes closer to the shape. Sweeps over the factors, greedily, from all W ≥ the slice; a map that
/// was more even before stays as it is.
/// @param given calibrated, so that e^L is the median radius.
RationalMap with_even_sides(const RationalMap& given);

}  // namespace qjulia::fitting
