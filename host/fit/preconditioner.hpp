#pragma once
/// A change of variables in which the energy is well scaled.

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace qjulia {

/// RᵀR = H + λ diag H by Cholesky's method, for H the Gauss-Newton matrix of the unknowns a stage
/// moves. A step u stands for the move R⁻¹ u of those unknowns. By u the energy's second derivative
/// is about the identity, so that L-BFGS starts as Newton's method does.
class Preconditioner {
 public:
  /// @param matrix H over all unknowns. @param active the unknowns moved, ascending.
  /// @param damping λ > 0, relative to the diagonal.
  Preconditioner(const Eigen::MatrixXd& matrix, const std::vector<std::size_t>& active,
                 double damping);

  /// R⁻¹ u: what the unknowns move by.
  Eigen::VectorXd move(const Eigen::VectorXd& u) const;
  /// R⁻ᵀ g: the gradient by u, from that by the unknowns.
  Eigen::VectorXd gradient(const Eigen::VectorXd& g) const;

 private:
  Eigen::VectorXd scale_;   ///< 1 / sqrt of the damped diagonal
  Eigen::MatrixXf factor_;  ///< Rᵀ of the matrix scaled to unit diagonal, lower triangle
};

}  // namespace qjulia
