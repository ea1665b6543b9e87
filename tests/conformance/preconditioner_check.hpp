#pragma once
/// What a preconditioner of a matrix must do, whatever makes it.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "base/random.hpp"
#include "energy/preconditioner.hpp"

namespace qjulia::test {

/// How far `made` is from a preconditioner of H + λ diag H, with S = diag(unit_scale).
struct PreconditionerError {
  /// Largest entry of |GᵀG − A|, A = S (H + λ diag H) S, where G's columns are R⁻ᵀ of those of
  /// A S⁻¹: G = R S for the exact R.
  double product;
  /// |gᵀ R⁻¹ u − uᵀ R⁻ᵀ g| / (|R⁻¹ u| |g|), at most, for random g and u.
  double transposed;
};

inline PreconditionerError error_of(const energy::Preconditioner& made, const Eigen::MatrixXd& h,
                                    double damping) {
  const Eigen::Index n = h.rows();
  const Eigen::VectorXd scale = energy::unit_scale(h.diagonal(), damping);
  Eigen::MatrixXd damped = h;
  damped.diagonal() = scale.cwiseAbs2().cwiseInverse();  // a small one keeps a small share
  Eigen::MatrixXd g(n, n);
  for (Eigen::Index i = 0; i < n; ++i) g.col(i) = made.gradient(damped.col(i) * scale[i]);
  const Eigen::MatrixXd expected = scale.asDiagonal() * damped * scale.asDiagonal();
  PreconditionerError error{(g.transpose() * g - expected).cwiseAbs().maxCoeff(), 0};
  base::Random random(7);
  for (int i = 0; i < 8; ++i) {
    Eigen::VectorXd u(n), v(n);
    for (double& entry : u) entry = random.uniform(-1, 1);
    for (double& entry : v) entry = random.uniform(-1, 1);
    const Eigen::VectorXd move = made.move(u);
    const double apart = std::abs(v.dot(move) - u.dot(made.gradient(v)));
    error.transposed = std::max(error.transposed, apart / (move.norm() * v.norm()));
  }
  return error;
}

}  // namespace qjulia::test
