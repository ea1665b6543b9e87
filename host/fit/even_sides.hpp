#pragma once
/// Which side of the slice each centre lies on: what F₁ on the slice leaves open.

#include "qjulia/rational_map.hpp"

namespace qjulia::fitting {

/// How much the fate of an image depends on its direction: the mean over directions of the 4-D
/// space of |ln ρ|, where ρ e^L is the radius at which F₁ first reaches its median over the sphere
/// of radius e^L, with ρ kept between ½ and 2.
double unevenness(const RationalMap& map);

/// Moves centres to the other side of the slice, W to 2 slice − W, where that makes the map less
/// uneven. F₁ on the slice knows only their distance from it and stays the same; the iterated set
/// comes closer to the shape. Sweeps over the factors, greedily, from all W ≥ the slice; a map that
/// was more even before stays as it is.
/// @param given calibrated, so that e^L is the median radius of {F₁ < L}.
RationalMap with_even_sides(const RationalMap& given);

}  // namespace qjulia::fitting
