#pragma once
/// How a map's field rises far from the shape, which samples do not show, and how it is made to.

#include <span>

#include "qjulia/device/device.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia::fitting {

/// The distance from the origin at which points are far from the shape: twice that of the farthest
/// corner of its box, in map units. @pre the frame has a box.
double far_from_shape(const Frame& frame);

/// Whether the first iterate takes points that are far from the shape farther away: F_1 > ln |q| in
/// 1,024 directions on spheres from that distance on. A small neighbourhood of a root beyond that
/// distance may slip between the tested points.
bool ends_near_shape(const Device& device, const Map& map);

/// The rational map without roots that are far from the shape, unless all factors are such roots,
/// and with exponents that sum to `degree`. F_1 keeps its mean at these points and changes little
/// there: the change b of exponents minimises the variance of Σ_k b_k ln |q - c_k| over the points,
/// plus a hundredth of that logarithm's mean variance times |b|².
/// @param surface points of the shape, in map units; the first 500 count.
/// @throws InputError if there are none.
Map with_raised_degree(Map map, std::span<const Eigen::Vector3d> surface, double degree);

}  // namespace qjulia::fitting
