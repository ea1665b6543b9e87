#pragma once
/// The Gauss-Newton matrix factorised on the device where it was computed.

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "energy/preconditioner.hpp"
#include "qjulia/device.hpp"

namespace qjulia::energy {

/// H_ij = d_i d_j rows_ij on a device, d² = `squared_scale`.
struct DeviceMatrix {
  const device::RealBuffer& rows;   ///< its upper triangle, by rows, in single precision
  std::size_t order;                ///< entries of a row
  std::vector<std::int32_t> place;  ///< row and column of H's i-th
  Eigen::VectorXd squared_scale;    ///< n
};

/// H's factor by blocks of QJ_CHOLESKY_BLOCK rows, in double precision.
/// @return nothing where the device has no double precision or too little memory, or H is so small
/// that launches would take longer than the work.
std::optional<CurvatureFactor> factorised(const Device& device, const DeviceMatrix& h,
                                          double damping);

/// The same factor as a preconditioner. In the layout of GPUs the device keeps R⁻¹ in single
/// precision, so that a product takes two launches where the host would solve for milliseconds.
/// In the layout of CPUs, or without memory for R⁻¹, the host solves.
/// @return null where `factorised` returns nothing.
std::unique_ptr<Preconditioner> make_preconditioner(const Device& device, const DeviceMatrix& h,
                                                    double damping);

}  // namespace qjulia::energy
