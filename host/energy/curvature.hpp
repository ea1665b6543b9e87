#pragma once
/// Gauss-Newton matrices, whole and by blocks of factors, and Cholesky's method on them.

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "energy/neighbour_blocks.hpp"

namespace qjulia::energy {

/// S (H + λ diag H) S = L Lᵀ for a symmetric matrix H of order n, where S = diag(scale) makes the
/// diagonal one.
struct CurvatureFactor {
  Eigen::VectorXd scale;  ///< n
  Eigen::MatrixXf lower;  ///< L, n × n, in its lower triangle

  /// S L⁻ᵀ u, solved in single precision.
  Eigen::VectorXd move(const Eigen::VectorXd& u) const;
  /// L⁻¹ S g, solved in single precision.
  Eigen::VectorXd gradient(const Eigen::VectorXd& g) const;
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

/// H as far as blocks of neighbours and the coarse space over them hold it. The coarse space moves
/// all factors of a block alike: it has the log scale, then of each block one variable for its
/// exponents and one for each of its centres' coordinates.
struct BlockCurvature {
  NeighbourBlocks blocks;  ///< B of them
  /// Of each block of m factors, H by their exponents, X, Y, Z and W: 5m × 5m.
  std::vector<Eigen::MatrixXd> own;
  Eigen::MatrixXd coarse;  ///< ZᵀHZ, of order 1 + 5B, where Z y is the move of coarse variables y
};

/// Σ γ^age H over the blocks of the stages so far, so that steps rest on more samples than one
/// stage draws. The blocks are the last stage's, and two factors that were not together in one
/// before start anew with each other, as a factor that was moved elsewhere does with all. What is
/// left out is whole blocks of each matrix, so the sum stays positive semidefinite.
struct CurvatureSum {
  /// γ: a matrix's weight relative to that of the next stage's.
  static constexpr double kKept = 0.85;

  BlockCurvature sum;      ///< its coarse matrix is the last stage's, and not kept in files
  Eigen::VectorXd weight;  ///< K: Σ γ^age over the matrices in each factor's sum

  /// @param moved the numbers of the factors that were moved elsewhere since the last matrix.
  void add(BlockCurvature next, const std::vector<std::size_t>& moved);
  /// Row and column i of the sum divided by the root of its factor's weight.
  BlockCurvature mean() const;
};

}  // namespace qjulia::energy
