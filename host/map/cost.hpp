#pragma once
/// What a factor costs at a point in kernels over a map, in multiplications (fused or not) and
/// divisions: the slots of the unit that limits it. Counted from the kernels' sources; additions,
/// comparisons and integer steps run beside them on the devices met so far.

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
/// U alone, where F is known.
constexpr double kVersorAlone = kStep - kLog2 - kTerm;
/// ∇F: 1/N, four sums.
constexpr double kFieldGradient = kDistance2 + 1 + 4;
/// kernels/gradient_orbit.cl: pull_back.
constexpr double kPullBack = kPolar + 3 + 3 + 3 + 6 + 6 + 9 + 1 + 4 + 1 + 8 + 3;
/// Bounds of F over a cube.
constexpr double kFieldBounds = 2 * (kDistance2 + 2 + kLog2 + kTerm);

/// F_n.
constexpr double field(int n) { return (n - 1) * kStep + kLogNorm; }

}  // namespace qjulia::cost
