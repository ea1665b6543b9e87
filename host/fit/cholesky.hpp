#pragma once
/// Cholesky's factorisation of dense matrices.

#include <Eigen/Core>

#include "qjulia/device.hpp"

namespace qjulia::fitting {

/// Replaces the lower triangle of a symmetric matrix H by that of L, H = LLᵀ; what is above the
/// diagonal stays. In double precision, on one core.
/// @return whether H is positive definite; if not, nothing can be said of the triangle.
bool cholesky(Eigen::MatrixXd& matrix);

/// The same on a device, by blocks of QJ_CHOLESKY_BLOCK rows, on devices with double precision and
/// memory for the matrix; on others, and for small matrices, as above.
bool cholesky(const Device& device, Eigen::MatrixXd& matrix);

}  // namespace qjulia::fitting
