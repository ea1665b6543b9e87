#pragma once
/// Random points that are the same with every compiler.

#include <Eigen/Core>

#include "base/random.hpp"

namespace qjulia::fitting {

/// Coordinates in [-half, half), z drawn first. Drawn as arguments of one call they would come in
/// an order that compilers choose: GCC for x86-64 begins with the last, GCC for aarch64 and Clang
/// with the first.
inline Eigen::Vector3d point_in_cube(base::Random& random, double half) {
  const double z = random.uniform(-half, half);
  const double y = random.uniform(-half, half);
  const double x = random.uniform(-half, half);
  return {x, y, z};
}

}  // namespace qjulia::fitting
