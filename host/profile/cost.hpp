#pragma once
/// What a factor costs in a kernel, in multiplications (fused or not) and divisions: the slots of
/// the unit that limits it. Counted from the kernels' sources; additions, comparisons and integer
/// steps run beside them on the devices met so far.

#include "layout/loss.h"

namespace qjulia::cost {

constexpr double kDistance2 = 4;  // |d|²
constexpr double kLog2 = 8;
constexpr double kTerm = 1;          // a ln N, added up
constexpr double kRoot = 6;          // one reciprocal root; 1/ρ, ρ and the tangent from it
constexpr double kAngle = 9;         // one odd polynomial
constexpr double kSineCosine = 14;   // for each θ: reduction and two polynomials
constexpr double kProduct = 16 + 4;  // Hamilton's product, and the versor from sine and cosine

/// F alone: kernels/energy.cl at its last iterate.
constexpr double kLogNorm = kDistance2 + kLog2 + kTerm;
/// One iterate: kind_step.
constexpr double kPolar = kDistance2 + kLog2 + kRoot + kAngle + kSineCosine;
constexpr double kStep = kPolar + kTerm + kProduct;
/// kernels/gradient_potential.cl: 1/N, the log's sum, four sums.
constexpr double kPotentialGradient = kDistance2 + kLog2 + 1 + 1 + 4;
/// kernels/gradient_orbit.cl: pull_back_last and pull_back.
constexpr double kPullBackLast = kDistance2 + kLog2 + 2 + 4 + 2;
constexpr double kPullBack = kPolar + 3 + 3 + 3 + 6 + 6 + 9 + 1 + 4 + 1 + 8 + 3;

/// Energy with n iterates, slots a factor.
constexpr double energy(int n) { return (n - 1) * kStep + kLogNorm; }
/// Energy and gradient with n iterates.
constexpr double gradient(int n) {
  return energy(n) + (n == 1 ? kPotentialGradient : (n - 1) * kPullBack + kPullBackLast);
}

// What kernels read and write of device memory at least, in reals: each its inputs and outputs
// once, sums that stay within a work-item not counted.

constexpr double kEnergyReals =
    QJ_SAMPLE_ARRAYS + 2;                          // for each sample: its arrays; field, cotangent
constexpr double kPotentialGradientReals = 4 + 1;  // for each sample: position, cotangent
/// Reals that a grid point takes: F, and for each further iterate the point and F, in and out.
constexpr double level_set_reals(int n) { return 1 + (n - 1) * 10.0; }
/// H from panels written and read once, H itself once for each block of `panel` samples.
constexpr double gauss_newton_reals(double samples, double order, double panel) {
  return 2 * samples * order + 2 * order * order * samples / panel;
}

}  // namespace qjulia::cost
