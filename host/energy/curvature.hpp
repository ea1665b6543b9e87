#pragma once
/// Gauss-Newton matrices, added up and factorised by Cholesky's method in double precision.

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "device/context.hpp"

namespace qjulia::energy {

/// S (H + λ diag H) S = L Lᵀ for a symmetric matrix H of order n, where S = diag(scale) makes the
/// diagonal one.
struct CurvatureFactor {
  Eigen::VectorXd scale;  ///< n
  /// L's lower triangle is that of the first n rows and columns; nothing is said of the rest.
  Eigen::MatrixXf lower;
};

/// S's diagonal, from that of H. A variable without effect on any sample (a centre of exponent 0,
/// say) keeps a small share.
/// @param damping λ > 0.
Eigen::VectorXd unit_scale(const Eigen::VectorXd& diagonal, double damping);

/// Calls `attempt(more)` with more = 1, 1 + λ, 1 + 10 λ, … below 2 until it returns true: until the
/// matrix with its entries off the diagonal divided by `more` is positive definite. It may not be
/// at first where rounding has made H slightly indefinite.
template <class Attempt>
void with_enough_damping(double damping, const Attempt& attempt) {
  bool is_positive = attempt(1.0);
  for (double more = damping; !is_positive && more < 1; more *= 10) is_positive = attempt(1 + more);
}

/// Factorises H + λ diag H on the host, with more damping where it is needed.
CurvatureFactor factorised(const Eigen::MatrixXd& h, double damping);

/// Σ γ^age H over the Gauss-Newton matrices of the stages so far, so that steps rest on more
/// samples than one stage draws. A factor that is moved elsewhere starts its rows and columns anew.
/// If an evaluator keeps the matrix elsewhere, only the weights are here.
struct CurvatureSum {
  /// γ: a matrix's weight relative to that of the next stage's.
  static constexpr double kKept = 0.85;

  Eigen::VectorXd weight;      ///< n: Σ γ^age over the matrices in each unknown's sum
  Eigen::MatrixXd matrix;      ///< n × n, where it is kept on the host
  device::RealBuffer rows;     ///< where it is kept on a device: its upper triangle, by rows,
  double samples_of_each = 1;  ///< divided by this

  /// Makes room for the next matrix.
  /// @param moved the numbers of the factors that were moved elsewhere since the last one.
  /// @return n factors d by which the sum so far must be scaled, d_i d_j H_ij; empty when there is
  /// no sum yet.
  Eigen::VectorXd faded(std::size_t factors, const std::vector<std::size_t>& moved);
};

}  // namespace qjulia::energy
