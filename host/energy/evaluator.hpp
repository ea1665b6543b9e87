#pragma once
/// Energy and gradient of a map over samples: what every optimiser step asks for.

#include <Eigen/Core>
#include <algorithm>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "energy/curvature.hpp"
#include "energy/preconditioner.hpp"
#include "energy/samples.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia::energy {

/// What an evaluator sums.
struct EnergySettings {
  Loss loss = Loss::distance;
  int iterations = 1;            ///< n, 1 … 16
  double alpha = 1;              ///< sharpness of the tanh
  double escape = kUsualEscape;  ///< escape radius, map units
};

/// What a sample adds to the energy, and its derivatives by F_n.
struct LossTerm {
  double energy = 0;
  double slope = 0;
  double curvature = 0;  ///< as in a Gauss-Newton matrix: never negative
};
/// What the i-th sample adds where F_n is `field`.
LossTerm loss_term(const Samples& samples, std::size_t i, double field,
                   const EnergySettings& options);

/// Unknowns of a map in one vector: S, then five arrays over the K factors: exponents, centres' X,
/// Y, Z, W. Gradients have the same layout. Length 1 + 5K.
std::vector<double> to_unknowns(const Map& map);
/// `map` with the unknowns taken from the vector.
Map with_unknowns(Map map, std::span<const double> unknowns);

struct Evaluation {
  double energy = 0;
  std::vector<double> gradient;  ///< 1 + 5K, or empty when not asked for
};

/// One set of samples, evaluated for many maps with the same number of factors.
class Evaluator {
 public:
  virtual ~Evaluator() = default;
  virtual Evaluation evaluate(const Map& map, bool with_gradient) = 0;
  /// F_n at each sample.
  virtual std::vector<double> field(const Map& map) = 0;
  /// A Gauss-Newton matrix H = JᵀWJ of the energy, of order 1 + 5K: J is ∂F_1 by the unknowns, at
  /// any n; W is the loss's second derivative at F_n (for the tanh loss w α² (1 − tanh²), which
  /// stays positive; 0 where a one-sided sample asks for nothing). Of many samples an evenly spaced
  /// part may stand for all.
  virtual Eigen::MatrixXd gauss_newton(const Map& map) = 0;
  /// Its diagonal, over all samples: for maps whose whole matrix would be too large.
  virtual Eigen::VectorXd gauss_newton_diagonal(const Map& map) = 0;
  /// H's blocks and the coarse matrix over them, with the samples of `gauss_newton`.
  virtual BlockCurvature gauss_newton_blocks(const Map& map, const NeighbourBlocks& blocks) = 0;
  /// The weighted scalar products over samples, of order 2 + m, of the columns 1, F_n − target and
  /// ln |x − c| for each of the m centres: what matching pursuit asks for, since F_1 is linear in
  /// exponents. Weights and samples are those of `gauss_newton`.
  virtual Eigen::MatrixXd pursuit_products(const Map& map,
                                           const std::vector<Quaternion>& centers) = 0;

 protected:
  Evaluator() = default;
  Evaluator(const Evaluator&) = default;
  Evaluator& operator=(const Evaluator&) = default;
};

/// Plain double loops with automatic differentiation: slow, and the standard of what is right.
std::unique_ptr<Evaluator> make_reference_evaluator(Samples samples, const EnergySettings& options);

/// The most samples over which a device sums H of this order, or H's blocks. Where there are more,
/// it takes an evenly spaced part of them. With fewer, steps follow the part rather than the whole
/// (docs/lab/fitting.md).
constexpr std::size_t curvature_samples(std::size_t order) {
  constexpr std::size_t kLeast = 10'240;
  return std::max(kLeast, 2 * order);
}

/// With more factors none are relocated, which costs as much as the number's cube, and levels that
/// move a part of the unknowns have H's diagonal in place of H.
constexpr std::size_t kMostByMatrix = 2560;

/// Kernels on a device.
std::unique_ptr<Evaluator> make_device_evaluator(const Device& device, const Samples& samples,
                                                 const EnergySettings& options,
                                                 Precision precision = Precision::single);

/// Bytes on a device that evaluations cannot do without.
struct DeviceNeed {
  std::uint64_t largest;  ///< of one buffer
  std::uint64_t all;
};
DeviceNeed device_need(std::size_t samples, std::size_t factors, const Tuning& tuning,
                       Precision precision);

/// Makes the evaluators of a fit: the reference's or a device's.
using EvaluatorFactory =
    std::function<std::unique_ptr<Evaluator>(const Samples&, const EnergySettings&)>;

}  // namespace qjulia::energy
