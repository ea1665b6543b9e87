#pragma once
/// Order along a space-filling curve.

#include <Eigen/Core>
#include <cstdint>

namespace qjulia::shape {

/// Place of `x` on the Morton curve through [-1, 1]^3, 21 bits an axis. Points outside count as the
/// nearest one inside, and coordinates that are not numbers as -1.
std::uint64_t morton_code(const Eigen::Vector3d& x);

}  // namespace qjulia::shape
