#include "fit/raised_degree.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "qjulia/error.hpp"

namespace qjulia::fitting {
namespace {

constexpr std::size_t kKeptPoints = 500;
constexpr double kVarianceRidge = 0.01;  ///< of the mean variance of a factor's logarithm

/// ln |q_p - c_k|, a row per point and a column per factor.
Eigen::MatrixXd logarithms(const Dynamics& dynamics, std::span<const Eigen::Vector3d> points) {
  Eigen::MatrixXd found(points.size(), dynamics.factors.size());
  for (Eigen::Index k = 0; k < found.cols(); ++k) {
    const Quaternion& center = dynamics.factors[static_cast<std::size_t>(k)].center;
    const Eigen::Vector3d in_slice(center.x, center.y, center.z);
    const double off_slice = dynamics.slice - center.w;
    for (Eigen::Index p = 0; p < found.rows(); ++p) {
      const double distance =
          std::hypot((points[static_cast<std::size_t>(p)] - in_slice).norm(), off_slice);
      found(p, k) = std::log(std::max(distance, 1e-9));
    }
  }
  return found;
}

/// b that minimises |A b - r|² + λ |b|² among those that sum to `sum`, by Woodbury's identity: the
/// matrix to factor has a row per point, however many factors there are.
Eigen::VectorXd constrained_ridge(const Eigen::MatrixXd& a, const Eigen::VectorXd& r, double sum) {
  const double ridge =
      std::max(kVarianceRidge * a.squaredNorm() / static_cast<double>(a.cols()), 1e-9);
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(a.rows(), a.rows());
  system.selfadjointView<Eigen::Lower>().rankUpdate(a);
  system.diagonal().array() += ridge;
  const auto factored = system.selfadjointView<Eigen::Lower>().llt();
  const Eigen::VectorXd row_sums = a.rowwise().sum();
  // (AᵀA + λ)⁻¹ Aᵀ r, and λ (AᵀA + λ)⁻¹ 1.
  const Eigen::VectorXd free = a.transpose() * factored.solve(r);
  const Eigen::VectorXd along =
      Eigen::VectorXd::Ones(a.cols()) - a.transpose() * factored.solve(row_sums);
  return free + (sum - free.sum()) / along.sum() * along;
}

/// Makes the columns' means 0, and returns what they were.
Eigen::RowVectorXd take_means(Eigen::MatrixXd& a) {
  Eigen::RowVectorXd means = a.colwise().mean();
  a.rowwise() -= means;
  return means;
}

Eigen::VectorXd exponents(const Dynamics& dynamics) {
  Eigen::VectorXd found(dynamics.factors.size());
  std::ranges::transform(dynamics.factors, found.begin(), &Factor::exponent);
  return found;
}

}  // namespace

Map with_raised_degree(Map map, std::span<const Eigen::Vector3d> surface, double reach,
                       double degree) {
  const auto points = surface.first(std::min(kKeptPoints, surface.size()));
  if (points.empty()) throw InputError("there are no points of the surface to keep the map at");
  Dynamics far = map.dynamics, &near = map.dynamics;
  const auto is_far = [&reach](const Factor& factor) {
    return factor.exponent > 0 && norm(factor.center) > reach;
  };
  if (std::ranges::all_of(near.factors, is_far)) reach = std::numeric_limits<double>::infinity();
  std::erase_if(near.factors, is_far);
  std::erase_if(far.factors, std::not_fn(is_far));

  Eigen::MatrixXd a = logarithms(near, points), of_far = logarithms(far, points);
  const Eigen::RowVectorXd means = take_means(a), far_means = take_means(of_far);
  const Eigen::VectorXd lost = exponents(far);
  const Eigen::VectorXd change =
      constrained_ridge(a, of_far * lost, degree - exponents(near).sum());
  for (std::size_t k = 0; k < near.factors.size(); ++k) {
    near.factors[k].exponent += change[static_cast<Eigen::Index>(k)];
  }
  near.log_scale += far_means.dot(lost) - means.dot(change);
  return map;
}

}  // namespace qjulia::fitting
