#include "fit/relocate.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace qjulia {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;
using Eigen::VectorXd;
using Eigen::VectorXf;

constexpr std::size_t kRows = 6000;  // samples the linear problems are posed over
constexpr int kCandidates = 600;
constexpr double kDamping = 1e-3;  // of the normal matrices, relative to their diagonals

/// Weighted residuals of some of the samples: r √w, and what is needed to extend the columns.
struct Residuals {
  std::vector<Eigen::Vector3d> position;
  VectorXd root;   ///< √w, 0 where a one-sided sample asks for nothing
  VectorXd value;  ///< √w (F − target)
};

Residuals take_residuals(const Samples& samples, const std::vector<double>& field) {
  const std::size_t rows = std::min(kRows, samples.size());
  Residuals r;
  r.root.resize(static_cast<Index>(rows));
  r.value.resize(static_cast<Index>(rows));
  for (std::size_t j = 0; j < rows; ++j) {
    const std::size_t i = j * samples.size() / rows;
    const double residual = field[i] - samples.target[i];
    const bool asks = samples.side[i] * residual <= 0;
    const auto row = static_cast<Index>(j);
    r.position.push_back(samples.position[i]);
    r.root[row] = asks ? std::sqrt(samples.weight[i]) : 0;
    r.value[row] = r.root[row] * residual;
  }
  return r;
}

/// √w ln |x − c| over the rows: F_1's derivative by the exponent of a factor at c.
VectorXf exponent_column(const Residuals& r, const Quaternion& c, double slice) {
  VectorXf column(r.root.size());
  const Eigen::Vector3d center(c.x, c.y, c.z);
  const double w2 = (slice - c.w) * (slice - c.w);
  for (Index i = 0; i < column.size(); ++i) {
    const double n = (r.position[static_cast<std::size_t>(i)] - center).squaredNorm() + w2;
    column[i] = static_cast<float>(0.5 * r.root[i] * std::log(std::max(n, 1e-30)));
  }
  return column;
}

MatrixXd damped_normal_matrix(const MatrixXf& columns) {
  MatrixXd h = (columns.transpose() * columns).cast<double>();
  h.diagonal() *= 1 + kDamping;
  h.diagonal().array() += 1e-12 * h.diagonal().mean();
  return h;
}

/// Indices of the `count` factors that are missed least, ascending; those that have drifted away
/// from the shape go first. The first column of the matrix is the log scale's.
std::vector<std::size_t> least_missed(const RationalMap& map, const MatrixXd& inverse, int count) {
  std::vector<std::size_t> order(map.factors.size());
  std::iota(order.begin(), order.end(), 0U);
  constexpr double kFarthest = 6;  // map units: no shape reaches so far from its deepest point
  const auto cost = [&](std::size_t k) {
    if (norm(map.factors[k].center) > kFarthest) return -1.0;
    const auto i = static_cast<Index>(k + 1);
    return map.factors[k].exponent * map.factors[k].exponent / inverse(i, i);
  };
  std::ranges::stable_sort(order, {}, cost);
  order.resize(static_cast<std::size_t>(count));
  std::ranges::sort(order);
  return order;
}

double distance_to_nearest(const RationalMap& map, const Eigen::Vector3d& x) {
  double nearest = 1e300;
  for (const auto& [c, exponent] : map.factors) {
    nearest = std::min(nearest, (Eigen::Vector3d(c.x, c.y, c.z) - x).norm());
  }
  return nearest;
}

/// Centres near samples drawn in proportion to |residual|^1.5, as wide as the space between the
/// factors there.
std::vector<Quaternion> draw_candidates(const RationalMap& map, const Residuals& r,
                                        Random& random) {
  std::vector<double> cumulative;
  double total = 0;
  for (Index i = 0; i < r.value.size(); ++i) {
    const double residual = r.root[i] > 0 ? std::abs(r.value[i] / r.root[i]) : 0;
    cumulative.push_back(total += std::pow(residual, 1.5));
  }
  std::vector<Quaternion> centers;
  for (int i = 0; i < kCandidates; ++i) {
    const auto at = std::ranges::lower_bound(cumulative, random.uniform(0, total));
    const auto& base = r.position[static_cast<std::size_t>(
        std::min<std::ptrdiff_t>(at - cumulative.begin(), r.value.size() - 1))];
    constexpr double kSmallestGap = 0.03;  // map units
    const double gap = std::max(distance_to_nearest(map, base), kSmallestGap);
    constexpr double kWidths[] = {0.25, 0.5, 1.0};
    const Eigen::Vector3d x =
        base + gap * Eigen::Vector3d(random.uniform(-0.8, 0.8), random.uniform(-0.8, 0.8),
                                     random.uniform(-0.8, 0.8));
    centers.push_back({x.x(), x.y(), x.z(), gap * kWidths[random.index(3)]});
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
      return std::hypot(d.x, d.y, d.z) > 1.4 * std::min(centers[i].w, centers[j].w);
    });
    if (apart) picked.push_back(i);
  }
  return picked;
}

}  // namespace

RationalMap relocate_factors(Evaluator& evaluator, const Samples& samples, const RationalMap& map,
                             int count, Random& random) {
  Residuals r = take_residuals(samples, evaluator.field(map));
  const auto factors = static_cast<Index>(map.factors.size());
  MatrixXf columns(r.root.size(), 1 + factors);
  columns.col(0) = r.root.cast<float>();
  for (Index k = 0; k < factors; ++k) {
    columns.col(1 + k) =
        exponent_column(r, map.factors[static_cast<std::size_t>(k)].center, map.slice);
  }

  // Remove: set the exponents to zero and let the others make up for it.
  RationalMap result = map;
  const MatrixXd inverse =
      damped_normal_matrix(columns).llt().solve(MatrixXd::Identity(1 + factors, 1 + factors));
  const auto removed = least_missed(map, inverse, count);
  const auto many = static_cast<Index>(removed.size());
  MatrixXd among(many, many);
  MatrixXd across(1 + factors, many);
  VectorXd exponents(many);
  for (Index j = 0; j < many; ++j) {
    const auto place = static_cast<Index>(removed[static_cast<std::size_t>(j)]) + 1;
    across.col(j) = inverse.col(place);
    exponents[j] = map.factors[static_cast<std::size_t>(place - 1)].exponent;
    for (Index i = 0; i < many; ++i) {
      among(i, j) = inverse(static_cast<Index>(removed[static_cast<std::size_t>(i)]) + 1, place);
    }
  }
  const VectorXd change = -across * among.llt().solve(exponents);
  const auto apply = [&](const VectorXd& move) {
    result.log_scale += move[0];
    for (Index k = 0; k < factors; ++k) {
      result.factors[static_cast<std::size_t>(k)].exponent += move[1 + k];
    }
    r.value += columns.cast<double>() * move;
  };
  apply(change);
  for (const std::size_t k : removed) {
    result.factors[k].exponent = 0;
    columns.col(static_cast<Index>(k) + 1).setZero();
  }

  // Insert: what each candidate could gain once the others have adapted to it.
  const auto centers = draw_candidates(map, r, random);
  MatrixXf trial(r.root.size(), static_cast<Index>(centers.size()));
  for (std::size_t i = 0; i < centers.size(); ++i) {
    trial.col(static_cast<Index>(i)) = exponent_column(r, centers[i], map.slice);
  }
  MatrixXd normal = damped_normal_matrix(columns);
  for (const std::size_t k : removed) {
    normal(static_cast<Index>(k) + 1, static_cast<Index>(k) + 1) = 1;  // an empty column
  }
  const Eigen::LLT<MatrixXd> cholesky(normal);
  const VectorXf value = r.value.cast<float>();
  const MatrixXd shadow = cholesky.matrixL().solve((columns.transpose() * trial).cast<double>());
  const VectorXd reached = cholesky.matrixL().solve((columns.transpose() * value).cast<double>());
  const VectorXd slope = (trial.transpose() * value).cast<double>() - shadow.transpose() * reached;
  const VectorXd full = trial.colwise().squaredNorm().transpose().cast<double>();
  const VectorXd own = (full - shadow.colwise().squaredNorm().transpose()).cwiseMax(1e-4 * full);
  const VectorXd gain = slope.array().square() / own.array();
  const auto picked = pick_apart(centers, gain, removed.size());
  for (std::size_t j = 0; j < picked.size(); ++j) {
    result.factors[removed[j]].center = centers[picked[j]];
    columns.col(static_cast<Index>(removed[j]) + 1) = trial.col(static_cast<Index>(picked[j]));
  }

  const VectorXd descent = -(columns.transpose() * r.value.cast<float>()).cast<double>();
  apply(damped_normal_matrix(columns).llt().solve(descent));
  return result;
}

}  // namespace qjulia
