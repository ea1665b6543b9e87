#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "fit/placement.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::fitting {
namespace {

using Eigen::Index;
using Points3 = std::vector<Eigen::Vector3d>;

constexpr std::size_t kSources = 1000;
constexpr std::size_t kCollocations = 2500;  // surface points where the potential is to be 1
constexpr std::size_t kProbes = 4000;        // outside points where the charges are to match it
constexpr std::size_t kMonopoleCandidates = 2000;
constexpr std::size_t kCandidatesPerFactor = 3;
constexpr double kDepth = 0.08;  // map units: sources nearer to the surface need more points there
constexpr double kProbeReach = 1.0;  // map units: probes are no farther out
constexpr double kRidge = 1e-8;      // added to the normal matrix, relative to its trace's mean

/// Up to `count` of the pool's points whose distance lies in (low, high), evenly over its order.
Points3 between(const SamplePool& pool, double low, double high, std::size_t count) {
  Points3 found;
  for (const auto* points : {&pool.near, &pool.around}) {
    for (const DistancePoint& p : *points) {
      if (p.distance > low && p.distance < high) found.push_back(p.position);
    }
  }
  Points3 taken;
  const std::size_t most = std::min(count, found.size());
  for (std::size_t i = 0; i < most; ++i) taken.push_back(found[i * found.size() / most]);
  return taken;
}

Points3 on_surface(const SamplePool& pool, std::size_t count, base::Random& random) {
  Points3 points;
  for (std::size_t i = 0; i < count; ++i) {
    points.push_back(pool.surface[random.index(pool.surface.size())].position);
  }
  return points;
}

/// 1 / |x_i − y_j|.
Eigen::MatrixXf monopole_fields(const Points3& at, const Points3& of) {
  Eigen::MatrixXf fields(static_cast<Index>(at.size()), static_cast<Index>(of.size()));
  for (Index j = 0; j < fields.cols(); ++j) {
    for (Index i = 0; i < fields.rows(); ++i) {
      const double r = (at[static_cast<std::size_t>(i)] - of[static_cast<std::size_t>(j)]).norm();
      fields(i, j) = static_cast<float>(1 / std::max(r, 1e-6));
    }
  }
  return fields;
}

/// The conductor's potential at the probes.
Eigen::VectorXf potential(const Points3& sources, const Points3& surface, const Points3& probes) {
  // Sources that are close to each other against their depth are nearly alike: in double, with a
  // ridge that rounding stays below.
  const Eigen::MatrixXd fields = monopole_fields(surface, sources).cast<double>();
  Eigen::MatrixXd normal = fields.transpose() * fields;
  normal.diagonal().array() += kRidge * normal.diagonal().mean();
  const Eigen::VectorXd wanted = fields.colwise().sum().transpose();
  const Eigen::VectorXd strengths = normal.llt().solve(wanted);
  return (monopole_fields(probes, sources).cast<double>() * strengths).cast<float>();
}

struct Charges {
  std::vector<Index> at;  ///< columns chosen
  Eigen::VectorXd charge;
};

/// Orthogonal matching pursuit by modified Gram-Schmidt: fields(chosen) = Q R.
Charges pursue(const Eigen::MatrixXf& fields, const Eigen::VectorXf& wanted, Index count) {
  const Eigen::VectorXf inverse_norm = fields.colwise().norm().cwiseInverse();
  Eigen::MatrixXf basis(fields.rows(), count);
  Eigen::MatrixXd upper = Eigen::MatrixXd::Zero(count, count);
  Eigen::VectorXd along(count);
  Eigen::VectorXf residual = wanted;
  Eigen::VectorXf open = Eigen::VectorXf::Ones(fields.cols());
  Charges charges;
  for (Index k = 0; k < count; ++k) {
    const Eigen::VectorXf correlation = (fields.transpose() * residual).cwiseProduct(inverse_norm);
    Index best = 0;
    correlation.cwiseAbs().cwiseProduct(open).maxCoeff(&best);
    open[best] = 0;
    charges.at.push_back(best);
    Eigen::VectorXf column = fields.col(best);
    for (Index j = 0; j < k; ++j) {
      const float part = basis.col(j).dot(column);
      upper(j, k) = part;
      column -= part * basis.col(j);
    }
    upper(k, k) = std::max(column.norm(), 1e-12F);
    basis.col(k) = column / static_cast<float>(upper(k, k));
    along[k] = basis.col(k).dot(residual);
    residual -= static_cast<float>(along[k]) * basis.col(k);
  }
  charges.charge = upper.triangularView<Eigen::Upper>().solve(along);
  return charges;
}

/// Σ a_k ln |x − c_k|.
double log_potential(const Map& map, const Eigen::Vector3d& x) {
  double sum = 0;
  for (const auto& [c, exponent] : map.dynamics.factors) {
    const double n = (x - Eigen::Vector3d(c.x, c.y, c.z)).squaredNorm();
    sum += 0.5 * exponent * std::log(std::max(n, 1e-12));
  }
  return sum;
}

/// Sets the log scale, and multiplies exponents by t, so that t Σ a ln r + S is nearest to d.
void regress_to_distance(Map& map, const SamplePool& pool) {
  constexpr std::size_t kPoints = 4000;
  const std::size_t count = std::min(kPoints, pool.near.size());
  Eigen::MatrixX2d columns(static_cast<Index>(count), 2);
  Eigen::VectorXd distance(static_cast<Index>(count));
  for (std::size_t i = 0; i < count; ++i) {
    const DistancePoint& p = pool.near[i * pool.near.size() / count];
    columns.row(static_cast<Index>(i)) << 1, log_potential(map, p.position);
    distance[static_cast<Index>(i)] = p.distance;
  }
  const Eigen::Matrix2d normal = columns.transpose() * columns;
  const Eigen::Vector2d found = normal.ldlt().solve(columns.transpose() * distance);
  map.dynamics.log_scale = found[0];
  for (auto& factor : map.dynamics.factors) factor.exponent *= found[1];
}

}  // namespace

Map place_monopoles(const SamplePool& pool, int factors, std::uint64_t seed) {
  base::Random random(seed);
  Points3 sources = between(pool, -1e9, -kDepth, kSources);
  // Thin shapes have nothing that deep.
  if (sources.size() < kSources / 4) sources = between(pool, -1e9, 0, kSources);
  const Points3 probes = between(pool, 0.01, kProbeReach, kProbes);
  if (sources.empty() || probes.size() < static_cast<std::size_t>(factors)) {
    throw InputError(
        fmt::format("there is too little inside or around the mesh to place {} factors as the "
                    "paper does; use fewer factors, or placement by depth",
                    factors));
  }
  const Points3 surface = on_surface(pool, kCollocations, random);
  const auto many =
      std::max(kMonopoleCandidates, kCandidatesPerFactor * static_cast<std::size_t>(factors));
  const Points3 candidates = on_surface(pool, many, random);
  const Charges charges =
      pursue(monopole_fields(probes, candidates), potential(sources, surface, probes), factors);
  Map map;
  for (const double sign : {1.0, -1.0}) {
    for (std::size_t k = 0; k < charges.at.size(); ++k) {
      const double charge = charges.charge[static_cast<Index>(k)];
      if (charge * sign <= 0) continue;
      const Eigen::Vector3d& x = candidates[static_cast<std::size_t>(charges.at[k])];
      map.dynamics.factors.push_back({{x.x(), x.y(), x.z(), 0}, charge});
    }
  }
  regress_to_distance(map, pool);
  return map;
}

}  // namespace qjulia::fitting
