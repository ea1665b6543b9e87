#pragma once
/// A change of variables in which the energy is well scaled.

#include <Eigen/Core>

#include "fit/curvature.hpp"

namespace qjulia::fitting {

/// RᵀR = H + λ diag H by Cholesky's method, for H the Gauss-Newton matrix by the variables a stage
/// moves. A step u stands for the move R⁻¹ u of those variables. By u the energy's second
/// derivative is about the identity, so that L-BFGS starts as Newton's method does.
class Preconditioner {
 public:
  explicit Preconditioner(CurvatureFactor factor) : factor_(std::move(factor)) {}
  /// From H's diagonal alone: R is the root of (1 + λ) diag H.
  Preconditioner(const Eigen::VectorXd& diagonal, double damping)
      : factor_{unit_scale(diagonal, damping), {}} {}

  /// R⁻¹ u: what the variables move by.
  Eigen::VectorXd move(const Eigen::VectorXd& u) const;
  /// R⁻ᵀ g: the gradient by u, from that by the variables.
  Eigen::VectorXd gradient(const Eigen::VectorXd& g) const;

 private:
  auto lower() const {
    return factor_.lower.topLeftCorner(factor_.scale.size(), factor_.scale.size());
  }

  /// R = Lᵀ S⁻¹; where `lower` is empty, L is the identity.
  CurvatureFactor factor_;
};

}  // namespace qjulia::fitting
