#pragma once
/// Changes of variables in which the energy is well scaled.

#include <Eigen/Core>
#include <memory>

#include "energy/curvature.hpp"

namespace qjulia::energy {

/// RᵀR = H + λ diag H by Cholesky's method, for H the Gauss-Newton matrix by the n variables a
/// stage moves. A step u stands for the move R⁻¹ u of those variables. By u the energy's second
/// derivative is about the identity, so that L-BFGS starts as Newton's method does.
class Preconditioner {
 public:
  virtual ~Preconditioner() = default;
  Preconditioner(const Preconditioner&) = delete;
  Preconditioner& operator=(const Preconditioner&) = delete;

  /// R⁻¹ u, of size n: the move of the variables.
  virtual Eigen::VectorXd move(const Eigen::VectorXd& u) const = 0;
  /// R⁻ᵀ g, of size n: the gradient by u, where g is the gradient by the variables.
  virtual Eigen::VectorXd gradient(const Eigen::VectorXd& g) const = 0;

 protected:
  Preconditioner() = default;
};

/// R = Lᵀ S⁻¹. The host solves with L in single precision.
std::unique_ptr<Preconditioner> preconditioner_of(CurvatureFactor factor);

/// From H's diagonal alone: R = ((1 + λ) diag H)^½.
std::unique_ptr<Preconditioner> preconditioner_of_diagonal(const Eigen::VectorXd& diagonal,
                                                           double damping);

}  // namespace qjulia::energy
