#include "fit/relocate.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "fit/random_point.hpp"

namespace qjulia::fitting {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kRelocationCandidates = 600;
constexpr double kDamping = 1e-3;  // added to normal matrices, relative to their diagonals

using Indices = std::vector<Index>;  // numbers of rows and columns of the products

MatrixXd damped(const MatrixXd& normal) {
  MatrixXd h = normal;
  h.diagonal() *= 1 + kDamping;
  h.diagonal().array() += 1e-12 * h.diagonal().mean();
  return h;
}

/// Indices of the `count` factors that are missed least, ascending; those that have drifted away
/// from the shape go before them. The first column of the matrix is the log scale's.
std::vector<std::size_t> least_missed(const Map& map, const MatrixXd& inverse, int count) {
  std::vector<std::size_t> order(map.dynamics.factors.size());
  std::iota(order.begin(), order.end(), 0U);
  constexpr double kFarthest = 6;  // map units: no shape reaches so far from its deepest point
  const auto cost = [&](std::size_t k) {
    if (norm(map.dynamics.factors[k].center) > kFarthest) return -1.0;
    const auto i = static_cast<Index>(k + 1);
    return map.dynamics.factors[k].exponent * map.dynamics.factors[k].exponent / inverse(i, i);
  };
  std::ranges::stable_sort(order, {}, cost);
  order.resize(static_cast<std::size_t>(count));
  std::ranges::sort(order);
  return order;
}

double distance_to_nearest(const Map& map, const Eigen::Vector3d& x) {
  double nearest = 1e300;
  for (const auto& [c, exponent] : map.dynamics.factors) {
    nearest = std::min(nearest, (Eigen::Vector3d(c.x, c.y, c.z) - x).norm());
  }
  return nearest;
}

/// Centres near samples drawn in proportion to |residual|^1.5, as wide as the space between the
/// factors there.
std::vector<Quaternion> draw_candidates(const Map& map, const Samples& samples,
                                        const std::vector<double>& field, base::Random& random) {
  std::vector<double> cumulative;
  double total = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double residual = field[i] - samples.target[i];
    const bool asks =
        samples.side[i] * residual <= 0 && samples.weight[i] > 0 && samples.off_slice[i] == 0;
    cumulative.push_back(total += asks ? std::pow(std::abs(residual), 1.5) : 0);
  }
  std::vector<Quaternion> centers;
  for (int i = 0; i < kRelocationCandidates; ++i) {
    const auto at = std::ranges::lower_bound(cumulative, random.uniform(0, total));
    const auto& base = samples.position[static_cast<std::size_t>(std::min<std::ptrdiff_t>(
        at - cumulative.begin(), static_cast<std::ptrdiff_t>(samples.size()) - 1))];
    constexpr double kSmallestGap = 0.03;  // map units
    const double gap = std::max(distance_to_nearest(map, base), kSmallestGap);
    constexpr double kWidths[] = {0.25, 0.5, 1.0};
    const Eigen::Vector3d x = base + gap * point_in_cube(random, 0.8);
    const double side = i % 2 == 0 ? 1 : -1;
    centers.push_back({x.x(), x.y(), x.z(), side * gap * kWidths[random.index(3)]});
  }
  return centers;
}

/// The candidates with the largest gains, none within another's width.
std::vector<std::size_t> pick_apart(const std::vector<Quaternion>& centers, const VectorXd& gain,
                                    std::size_t count) {
  std::vector<std::size_t> order(centers.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::stable_sort(order, std::greater<>(),
                           [&](std::size_t i) { return gain[static_cast<Index>(i)]; });
  std::vector<std::size_t> picked;
  for (const std::size_t i : order) {
    if (picked.size() == count) break;
    const bool apart = std::ranges::all_of(picked, [&](std::size_t j) {
      const Quaternion d = centers[i] - centers[j];
      return std::hypot(d.x, d.y, d.z) >
             1.4 * std::min(std::abs(centers[i].w), std::abs(centers[j].w));
    });
    if (apart) picked.push_back(i);
  }
  return picked;
}

}  // namespace

Map relocate_factors(Evaluator& evaluator, const Samples& samples, const Map& map, int count,
                     base::Random& random) {
  const auto factors = static_cast<Index>(map.dynamics.factors.size());
  const auto candidates = draw_candidates(map, samples, evaluator.field(map), random);
  std::vector<Quaternion> centers;
  for (const auto& factor : map.dynamics.factors) centers.push_back(factor.center);
  centers.insert(centers.end(), candidates.begin(), candidates.end());
  // Scalar products of all columns: 0 the log scale's, 1 the residual, then factors, candidates.
  const MatrixXd products = evaluator.pursuit_products(map, centers);
  constexpr Index kResidual = 1;
  Indices own(1 + map.dynamics.factors.size()), trial(candidates.size());
  std::iota(own.begin() + 1, own.end(), kResidual + 1);
  std::iota(trial.begin(), trial.end(), own.back() + 1);

  // Remove: set exponents to zero and let the others make up for it.
  const MatrixXd inverse =
      damped(products(own, own)).llt().solve(MatrixXd::Identity(1 + factors, 1 + factors));
  const auto removed = least_missed(map, inverse, count);
  Indices gone;
  VectorXd exponents(static_cast<Index>(removed.size()));
  for (const std::size_t k : removed) {
    exponents[static_cast<Index>(gone.size())] = map.dynamics.factors[k].exponent;
    gone.push_back(static_cast<Index>(k) + 1);
  }
  VectorXd move = -inverse(Eigen::all, gone) * MatrixXd(inverse(gone, gone)).llt().solve(exponents);
  // The residual after that move, with any columns.
  const auto with_residual = [&](const Indices& columns) -> VectorXd {
    return products(columns, kResidual) + products(columns, own) * move;
  };

  // Insert: what each candidate could gain once the others have adapted to it.
  Indices kept;
  for (Index i = 0; i <= factors; ++i) {
    if (std::ranges::find(gone, i) == gone.end()) kept.push_back(own[static_cast<std::size_t>(i)]);
  }
  const Eigen::LLT<MatrixXd> cholesky(damped(products(kept, kept)));
  const MatrixXd shadow = cholesky.matrixL().solve(MatrixXd(products(kept, trial)));
  const VectorXd reached = cholesky.matrixL().solve(with_residual(kept));
  const VectorXd slope = with_residual(trial) - shadow.transpose() * reached;
  const VectorXd full = products(trial, trial).diagonal();
  const VectorXd left = (full - shadow.colwise().squaredNorm().transpose()).cwiseMax(1e-4 * full);
  const VectorXd gain = slope.array().square() / left.array();

  // The new ones take the places of those removed, and all exponents are refitted.
  Map result = map;
  for (const std::size_t k : removed) result.dynamics.factors[k].exponent = 0;
  Indices now = own;
  const auto picked = pick_apart(candidates, gain, removed.size());
  for (std::size_t j = 0; j < picked.size(); ++j) {
    result.dynamics.factors[removed[j]].center = candidates[picked[j]];
    now[removed[j] + 1] = trial[picked[j]];
  }
  const VectorXd refit = damped(products(now, now)).llt().solve(-with_residual(now));
  for (const Index i : gone) move[i] = 0;
  move += refit;
  result.dynamics.log_scale += move[0];
  for (Index k = 0; k < factors; ++k) {
    result.dynamics.factors[static_cast<std::size_t>(k)].exponent += move[1 + k];
  }
  return result;
}

}  // namespace qjulia::fitting
