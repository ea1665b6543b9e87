#pragma once
/// The iteration in plain double loops, written straight from Kim 2015 and sharing nothing with the
/// kernels: the standard of what is right. Slow.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "qjulia/map/map.hpp"

namespace qjulia::reference {

/// One iterate R(q) = e^log_norm · versor.
struct Step {
  double log_norm = 0;
  Quaternion versor;
};
Step step(const Map& map, const Quaternion& q);

/// F_n at each start (4-D, map coordinates); ln |start| where it is not below `escape`.
std::vector<double> field(const Map& map, std::span<const Quaternion> starts, int iterations,
                          double escape);

/// ∂F_n by the unknowns, by forward-mode automatic differentiation. One row a start; columns as in
/// `to_unknowns`: S, then exponents, centres' X, Y, Z, W.
Eigen::MatrixXd field_gradients(const Map& map, std::span<const Quaternion> starts, int iterations,
                                double escape);

/// ∂F_n/∂q at each start, likewise. Noise counts as constant.
std::vector<Quaternion> point_gradients(const Map& map, std::span<const Quaternion> starts,
                                        int iterations, double escape);

}  // namespace qjulia::reference
