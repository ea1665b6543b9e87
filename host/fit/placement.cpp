#include "fit/placement.hpp"

#include <LBFGSB.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

#include "device/context.hpp"
#include "fit/farthest_points.hpp"
#include "fit/lbfgs.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::fitting {
namespace {

constexpr double kCell = 4.0 / 97;  // map units
constexpr double kInsideShare = 0.6;
constexpr std::size_t kPlacementCandidates = 15'000;  // candidates on each side
constexpr double kOutsideReach = 6 * kCell;
constexpr double kOutsideSpacing = 1.5;  // against the inside's at the same distance

/// Candidates of one side (−1 inside, +1 outside): at least `nearest` from the surface.
std::vector<DistancePoint> candidates(const SamplePool& pool, double side, double nearest) {
  std::vector<DistancePoint> found;
  for (const auto* points : {&pool.around, &pool.near}) {
    for (const DistancePoint& p : *points) {
      const double d = side * p.distance;
      if (d > nearest && (side < 0 || d < kOutsideReach) && found.size() < kPlacementCandidates) {
        found.push_back(p);
      }
    }
  }
  return found;
}

/// Points spaced in proportion to their distance from the surface: each lies farthest from those
/// before it, counted in its own radii.
std::vector<DistancePoint> spread(const std::vector<DistancePoint>& from, std::size_t count,
                                  double spacing) {
  std::vector<double> squared_radius(from.size());
  std::ranges::transform(from, squared_radius.begin(), [spacing](const DistancePoint& p) {
    return std::pow(spacing * std::max(std::abs(p.distance), kCell), 2);
  });
  const auto widest = std::ranges::max_element(squared_radius) - squared_radius.begin();
  const auto found = farthest_points(
      from.size(), count, static_cast<std::size_t>(widest), [&](std::size_t i, std::size_t j) {
        return (from[i].position - from[j].position).squaredNorm() / squared_radius[i];
      });
  std::vector<DistancePoint> chosen;
  for (const std::size_t i : found.chosen) chosen.push_back(from[i]);
  return chosen;
}

using Objective = std::function<double(const Eigen::VectorXd&, Eigen::VectorXd&)>;

/// ½ Σ w (F_1 − d)² by the log scale and the exponents: a quadratic, in small maps by its matrix.
Objective distance_energy(Evaluator& evaluator, const Map& map, bool by_matrix) {
  const auto n = static_cast<Eigen::Index>(1 + map.dynamics.factors.size());
  Objective by_evaluation = [&evaluator, map, n](const Eigen::VectorXd& x,
                                                 Eigen::VectorXd& gradient) {
    auto unknowns = to_unknowns(map);
    std::copy(x.begin(), x.end(), unknowns.begin());
    const Evaluation found = evaluator.evaluate(with_unknowns(map, unknowns), true);
    gradient = Eigen::Map<const Eigen::VectorXd>(found.gradient.data(), n);
    return found.energy;
  };
  if (!by_matrix) return by_evaluation;
  std::vector<Quaternion> centers;
  for (const auto& factor : map.dynamics.factors) centers.push_back(factor.center);
  Eigen::MatrixXd products;
  try {
    products = evaluator.pursuit_products(map, centers);
  } catch (const DeviceError& error) {
    if (!device::is_out_of_memory(error)) throw;
    return by_evaluation;
  }
  constexpr Eigen::Index kResidual = 1;  // its row and column; the others are the unknowns'
  std::vector<Eigen::Index> own(1 + map.dynamics.factors.size());
  std::iota(own.begin() + 1, own.end(), kResidual + 1);
  const Eigen::MatrixXd hessian = products(own, own);
  const Eigen::VectorXd slope = products(own, kResidual);  // at zero scale and exponents
  return [hessian, slope](const Eigen::VectorXd& x, Eigen::VectorXd& gradient) {
    gradient = hessian * x + slope;
    return 0.5 * x.dot(gradient + slope);
  };
}

/// Exponents and log scale that minimise ½ Σ w (F_1 − d)²; each exponent keeps the sign of its
/// side. The map comes with exponents and log scale 0.
void fit_exponents(Evaluator& evaluator, Map& map, std::size_t inside) {
  const bool by_matrix = map.dynamics.factors.size() <= kMostByMatrix;
  const Objective energy = distance_energy(evaluator, map, by_matrix);
  const auto n = static_cast<Eigen::Index>(1 + map.dynamics.factors.size());
  const Eigen::VectorXd scale =
      (evaluator.gauss_newton_diagonal(map).head(n).array() + 1e-12).sqrt().inverse();

  const double none = std::numeric_limits<double>::infinity();
  Eigen::VectorXd x = Eigen::VectorXd::Zero(n);
  Eigen::VectorXd low = Eigen::VectorXd::Zero(n);
  Eigen::VectorXd high = Eigen::VectorXd::Zero(n);
  const auto roots = static_cast<Eigen::Index>(inside);
  high.head(1 + roots).setConstant(none);
  low.tail(n - 1 - roots).setConstant(-none);
  low[0] = -none;
  // In units of each unknown's effect; a trace-sized ridge keeps twins of one another apart.
  const double ridge = 1e-6;
  auto scaled = [&](const Eigen::VectorXd& y, Eigen::VectorXd& gradient) {
    const double value = energy(scale.cwiseProduct(y), gradient);
    gradient = scale.cwiseProduct(gradient) + ridge * y;
    return value + 0.5 * ridge * y.squaredNorm();
  };
  LBFGSpp::LBFGSBParam<double> parameters;
  parameters.m = 20;
  // An evaluation without the matrix costs as much as one of the fit.
  parameters.max_iterations = by_matrix ? 300 : 60;
  parameters.epsilon = 1e-7;
  parameters.epsilon_rel = 0;
  LBFGSpp::LBFGSBSolver<double> solver(parameters);
  double value = 0;
  run_lbfgs(scaled, [&](auto& objective) { solver.minimize(objective, x, value, low, high); });
  x = scale.cwiseProduct(x);
  map.dynamics.log_scale = x[0];
  for (Eigen::Index i = 1; i < n; ++i)
    map.dynamics.factors[static_cast<std::size_t>(i - 1)].exponent = x[i];
}

}  // namespace

int most_factors(const SamplePool& pool) {
  const auto inside = static_cast<double>(candidates(pool, -1, 0).size());
  const auto outside = static_cast<double>(candidates(pool, +1, 0).size());
  return static_cast<int>(std::min(inside / kInsideShare, outside / (1 - kInsideShare)));
}

Map place_factors(const EvaluatorFactory& make_evaluator, const SamplePool& pool, int factors,
                  std::uint64_t seed) {
  const auto inside = static_cast<std::size_t>(std::lround(kInsideShare * factors));
  const auto outside = static_cast<std::size_t>(factors) - inside;
  Map map;
  const auto add = [&](double side, std::size_t count, double spacing) {
    auto found = candidates(pool, side, 0.8 * kCell);
    // A plate thinner than two cells has nothing that deep: any inner point will do.
    if (found.size() < 4 * count) found = candidates(pool, side, 0);
    if (found.size() < count) {
      throw InputError(
          fmt::format("too little {} of the mesh to place {} factors in; use fewer "
                      "factors or check that the mesh encloses a volume",
                      side < 0 ? "inside" : "around", count));
    }
    double turn = 1;  // centres lie on the slice's two sides by turns
    for (const DistancePoint& p : spread(found, count, spacing)) {
      const double w = turn * (0.02 + 0.5 * std::abs(p.distance));
      map.dynamics.factors.push_back({{p.position.x(), p.position.y(), p.position.z(), w}, 0});
      turn = -turn;
    }
  };
  add(-1, inside, 1);
  add(+1, outside, kOutsideSpacing);

  Samples samples;
  base::Random random(seed);
  constexpr int kNear = 16'000;
  constexpr int kAround = 4'000;
  const auto add_sample = [&](const DistancePoint& p) {
    constexpr double kLargest = 0.4;  // map units: farther distances need not be matched
    samples.add(p.position, 1 / std::max(std::abs(p.distance), kCell / 2),
                std::clamp(p.distance, -kLargest, kLargest), 0);
  };
  for (int i = 0; i < kNear; ++i) add_sample(pool.near[random.index(pool.near.size())]);
  for (int i = 0; i < kAround; ++i) add_sample(pool.around[random.index(pool.around.size())]);
  for (double& w : samples.weight) w /= kNear + kAround;
  const auto evaluator = make_evaluator(samples, {});
  fit_exponents(*evaluator, map, inside);
  return map;
}

}  // namespace qjulia::fitting
