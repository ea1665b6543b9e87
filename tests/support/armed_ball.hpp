#pragma once
/// Maps for tests, made on the spot: always the same ones.

#include <Eigen/Core>
#include <vector>

#include "qjulia/map/map.hpp"

namespace qjulia::test {

/// A ball of radius 0.75 about the origin with three arms: signed distance and its extent.
double armed_ball_distance(const Eigen::Vector3d& x);
/// Points on its surface, not quite uniform.
std::vector<Eigen::Vector3d> armed_ball_surface(std::size_t count);

/// F_1 fitted to `armed_ball_distance` near the surface by linear least squares over the exponents
/// of `factors` factors set on both sides of it. Slope about 1, not calibrated.
Map armed_ball_map(int factors);

}  // namespace qjulia::test
