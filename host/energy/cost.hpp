#pragma once
/// What energies, gradients and matrices cost: slots of a factor at a sample (map/cost.hpp), and
/// the reals that kernels read and write of device memory at least, each input and output once.
/// Sums that stay within a work-item are not counted.

#include "layout/loss.h"
#include "map/cost.hpp"

namespace qjulia::cost {

/// kernels/gradient_potential.cl: 1/N, the log's sum, four sums.
constexpr double kPotentialGradient = kDistance2 + kLog2 + 1 + 1 + 4;
/// kernels/gradient_orbit.cl: pull_back_last.
constexpr double kPullBackLast = kDistance2 + kLog2 + 2 + 4 + 2;
/// kernels/gauss_newton.cl: five weighted entries of J; one entry of a pursuit.
constexpr double kJacobianEntry = kDistance2 + kLog2 + 1 + 1 + 4 + 5;
constexpr double kPursuitEntry = kDistance2 + kLog2 + 1;

/// Energy with n iterates.
constexpr double energy(int n) { return field(n); }
/// Energy and gradient with n iterates.
constexpr double gradient(int n) {
  return energy(n) + (n == 1 ? kPotentialGradient : (n - 1) * kPullBack + kPullBackLast);
}

/// For each sample: its arrays; field, cotangent.
constexpr double kEnergyReals = QJ_SAMPLE_ARRAYS + 2;
/// For each sample: position, cotangent.
constexpr double kPotentialGradientReals = 4 + 1;
/// H from panels written and read once, H itself once for each block of `panel` samples.
constexpr double gauss_newton_reals(double samples, double order, double panel) {
  return 2 * samples * order + 2 * order * order * samples / panel;
}

}  // namespace qjulia::cost
