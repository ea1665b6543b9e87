#pragma once
/// The factorised Gauss-Newton matrix: Cholesky's method in double precision, on the host or where
/// the matrix was computed.

#include <Eigen/Core>
#include <optional>
#include <utility>
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

/// Where rounding in H has cost the last digits of positiveness, more damping restores it: what is
/// beside the diagonal is divided by 1 + λ, 1 + 10 λ, …
CurvatureFactor factorised(const Eigen::MatrixXd& h, double damping);

/// A change of variables in which the energy is well scaled. RᵀR = H + λ diag H by Cholesky's
/// method, for H the Gauss-Newton matrix by the variables a stage moves. A step u stands for the
/// move R⁻¹ u of those variables. By u the energy's second derivative is about the identity, so
/// that L-BFGS starts as Newton's method does.
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

/// H_ij = d_i d_j rows_ij on a device, d² = `squared_scale`.
struct DeviceMatrix {
  const device::RealBuffer& rows;   ///< its upper triangle, by rows, in single precision
  std::size_t order;                ///< entries of a row
  std::vector<std::int32_t> place;  ///< row and column of H's i-th
  Eigen::VectorXd squared_scale;    ///< n
};

/// The same on the device, by blocks of QJ_CHOLESKY_BLOCK rows.
/// @return nothing where the device has no double precision or too little memory, or H is so small
/// that launches would take longer than the work.
std::optional<CurvatureFactor> factorised(const Device& device, const DeviceMatrix& h,
                                          double damping);

}  // namespace qjulia::energy
