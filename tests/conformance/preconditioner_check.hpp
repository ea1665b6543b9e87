#pragma once
/// What a preconditioner of a matrix must do, whatever makes it.

#include <Eigen/Core>
#include <cmath>

#include "base/larger_error.hpp"
#include "base/random.hpp"
#include "energy/preconditioner.hpp"

namespace qjulia::test {

/// How far `made` is from a preconditioner of H + λ diag H, with S = diag(unit_scale).
struct PreconditionerError {
  /// Largest entry of |GᵀG − A|, where A = S (H + λ diag H) S and G = R⁻ᵀ (H + λ diag H) S, column
  /// by column. With the exact R, G = R S.
  double product;
  /// Largest |vᵀ R⁻¹ u − uᵀ R⁻ᵀ v| / (|R⁻¹ u| |v|) over eight random pairs u, v.
  double transposed;
};

inline PreconditionerError error_of(const energy::Preconditioner& made, const Eigen::MatrixXd& h,
                                    double damping) {
  const Eigen::Index n = h.rows();
  const Eigen::VectorXd scale = energy::unit_scale(h.diagonal(), damping);
  Eigen::MatrixXd damped = h;
  damped.diagonal() = scale.cwiseAbs2().cwiseInverse();  // with the floor of unit_scale
  Eigen::MatrixXd g(n, n);
  for (Eigen::Index i = 0; i < n; ++i) g.col(i) = made.gradient(damped.col(i) * scale[i]);
  const Eigen::MatrixXd expected = scale.asDiagonal() * damped * scale.asDiagonal();
  PreconditionerError error{0, 0};
  const Eigen::MatrixXd difference = g.transpose() * g - expected;
  for (const double entry : difference.reshaped()) {
    error.product = base::larger_error(error.product, std::abs(entry));
  }
  base::Random random(7);
  for (int i = 0; i < 8; ++i) {
    Eigen::VectorXd u(n), v(n);
    for (double& entry : u) entry = random.uniform(-1, 1);
    for (double& entry : v) entry = random.uniform(-1, 1);
    const Eigen::VectorXd move = made.move(u);
    const double apart = std::abs(v.dot(move) - u.dot(made.gradient(v)));
    error.transposed = base::larger_error(error.transposed, apart / (move.norm() * v.norm()));
  }
  return error;
}

}  // namespace qjulia::test
