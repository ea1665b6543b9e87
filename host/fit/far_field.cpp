#include "fit/far_field.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "map/sphere_directions.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/field.hpp"

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

double far_from_shape(const Frame& frame) {
  const Eigen::Vector3d low = frame.shape_to_map.to_map(frame.box->low);
  const Eigen::Vector3d high = frame.shape_to_map.to_map(frame.box->high);
  return 2 * low.cwiseAbs().cwiseMax(high.cwiseAbs()).norm();
}

bool ends_near_shape(const Device& device, const Map& map) {
  constexpr double kNextSphere = 1.25, kBeyondFactors = 8;
  constexpr std::size_t kDirections = 1024;
  if (map.dynamics.degree() <= 1) return false;
  const double nearest = far_from_shape(map.frame);
  double farthest = nearest;
  for (const Factor& factor : map.dynamics.factors) {
    farthest = std::max(farthest, kBeyondFactors * norm(factor.center));
  }
  const std::vector<Quaternion> directions = map::sphere_directions(kDirections);
  std::vector<Quaternion> points;
  for (double radius = nearest; radius < kNextSphere * farthest; radius *= kNextSphere) {
    for (const Quaternion& direction : directions) points.push_back(radius * direction);
  }
  // F_1 itself, however far out: no escape radius.
  constexpr StopRadii kNone{0, 0, std::numeric_limits<double>::infinity()};
  const std::vector<double> field = Field(device, map, Precision::single, kNone).at(points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!(field[i] > std::log(norm(points[i])))) return false;
  }
  return true;
}

Map with_raised_degree(Map map, std::span<const Eigen::Vector3d> surface, double degree) {
  const auto points = surface.first(std::min(kKeptPoints, surface.size()));
  if (points.empty()) throw InputError("there are no points of the surface to keep the map at");
  Dynamics far = map.dynamics, &near = map.dynamics;
  const double distance = far_from_shape(map.frame);
  const auto is_far = [distance](const Factor& factor) {
    return factor.exponent > 0 && norm(factor.center) > distance;
  };
  const bool has_near = !std::ranges::all_of(near.factors, is_far);
  const auto is_left_out = [&](const Factor& factor) { return has_near && is_far(factor); };
  std::erase_if(near.factors, is_left_out);
  std::erase_if(far.factors, std::not_fn(is_left_out));

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
