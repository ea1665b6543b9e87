#pragma once
/// A change of variables in which the energy is well scaled.

#include <Eigen/Core>
#include <functional>

#include "fit/cholesky.hpp"

namespace qjulia::fitting {

/// RᵀR = H + λ diag H by Cholesky's method, for H the Gauss-Newton matrix by the variables a stage
/// moves. A step u stands for the move R⁻¹ u of those variables. By u the energy's second
/// derivative is about the identity, so that L-BFGS starts as Newton's method does.
class Preconditioner {
 public:
  /// @param damping λ > 0, relative to the diagonal.
  /// @param factorise as Evaluator::cholesky.
  Preconditioner(
      const Eigen::MatrixXd& matrix, double damping,
      const std::function<bool(Eigen::MatrixXd&)>& factorise = [](auto& m) { return cholesky(m); });
  /// From H's diagonal alone: R is the root of (1 + λ) diag H.
  Preconditioner(const Eigen::VectorXd& diagonal, double damping);

  /// R⁻¹ u: what the variables move by.
  Eigen::VectorXd move(const Eigen::VectorXd& u) const;
  /// R⁻ᵀ g: the gradient by u, from that by the variables.
  Eigen::VectorXd gradient(const Eigen::VectorXd& g) const;

 private:
  Eigen::VectorXd scale_;  ///< 1 / sqrt of the damped diagonal
  /// Rᵀ of the matrix scaled to unit diagonal, lower triangle; empty where that is the identity.
  Eigen::MatrixXf factor_;
};

}  // namespace qjulia::fitting
