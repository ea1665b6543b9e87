#pragma once
/// Changes of variables in which the energy is well scaled.

#include <Eigen/Core>
#include <memory>

#include "energy/curvature.hpp"

namespace qjulia::energy {

/// A step u stands for the move M u of the n variables that a stage moves, where M Mᵀ is about the
/// inverse of H + λ diag H, for H the Gauss-Newton matrix by these variables. So by u, L-BFGS
/// starts about as Newton's method does. M may have more columns than rows; then a step has more
/// numbers than the move.
class Preconditioner {
 public:
  virtual ~Preconditioner() = default;
  Preconditioner(const Preconditioner&) = delete;
  Preconditioner& operator=(const Preconditioner&) = delete;

  /// How many numbers a step has: n or more.
  virtual Eigen::Index size() const = 0;
  /// M u, of size n: the move of the variables.
  virtual Eigen::VectorXd move(const Eigen::VectorXd& u) const = 0;
  /// Mᵀ g: the gradient by u, where g is the gradient by the variables.
  virtual Eigen::VectorXd gradient(const Eigen::VectorXd& g) const = 0;

 protected:
  Preconditioner() = default;
};

/// M = S L⁻ᵀ, the inverse of Cholesky's factor. The host solves with L in single precision.
std::unique_ptr<Preconditioner> preconditioner_of(CurvatureFactor factor);

/// From blocks of neighbouring factors and the coarse space over them: M Mᵀ is the sum of the
/// inverses of all blocks and of the coarse matrix, each damped, in its own place (additive
/// Schwarz). A step has 5K + 1 + 5B numbers.
std::unique_ptr<Preconditioner> preconditioner_of(const BlockCurvature& curvature, double damping);

/// From H's diagonal alone: M = ((1 + λ) diag H)^−½.
std::unique_ptr<Preconditioner> preconditioner_of_diagonal(const Eigen::VectorXd& diagonal,
                                                           double damping);

}  // namespace qjulia::energy
