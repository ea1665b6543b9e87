#pragma once
/// The factorised Gauss-Newton matrix: Cholesky's method in double precision, on the host or where
/// the matrix was computed.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "device/context.hpp"

namespace qjulia::fitting {

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

/// A matrix on a device, in single precision.
struct DeviceMatrix {
  const device::RealBuffer& rows;   ///< its upper triangle, by rows
  std::size_t order;                ///< entries of a row
  std::vector<std::int32_t> place;  ///< row and column of H's i-th
  double factor;                    ///< H is so many times what is there
};

/// The length of a buffer that `factorised` can work in, for H of order n.
std::size_t factorised_size(std::size_t n);

/// The same on the device, by blocks of QJ_CHOLESKY_BLOCK rows. The result takes the matrix's place
/// there, whose buffer holds `factorised_size` reals.
/// @return nothing where the device has no double precision or too little memory, or H is so small
/// that launches would take longer than the work; the matrix is then as it was.
std::optional<CurvatureFactor> factorised(const Device& device, const DeviceMatrix& h,
                                          double damping);

}  // namespace qjulia::fitting
