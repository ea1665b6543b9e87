#pragma once
/// Maps whose field rises too little far from the shape.

#include <span>

#include "qjulia/map.hpp"

namespace qjulia::fitting {

/// The rational map without roots that are farther than `reach` from the origin, unless all factors
/// are such roots, and with exponents that sum to `degree`. F_1 keeps its mean at these points and
/// changes little there: the change b of exponents minimises the variance of Σ_k b_k ln |q - c_k|
/// over the points, plus a hundredth of that logarithm's mean variance times |b|².
/// @param surface points of the shape, in map units; the first 500 count.
/// @throws InputError if there are none.
Map with_raised_degree(Map map, std::span<const Eigen::Vector3d> surface, double reach,
                       double degree);

}  // namespace qjulia::fitting
