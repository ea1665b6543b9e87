#include "fit/misplaced.hpp"

#include <algorithm>
#include <cmath>

namespace qjulia::fitting {
namespace {

constexpr std::size_t kPerFactor = 7;  // points

}  // namespace

std::vector<Eigen::Vector3d> points_at_centers(const RationalMap& map) {
  std::vector<Eigen::Vector3d> points;
  for (const auto& [c, exponent] : map.factors) {
    const Eigen::Vector3d center(c.x, c.y, c.z);
    points.push_back(center);
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d step = (c.w - map.slice) * Eigen::Vector3d::Unit(axis);
      points.emplace_back(center + step);
      points.emplace_back(center - step);
    }
  }
  return points;
}

MisplacedFactors misplaced_factors(const RationalMap& map, const std::vector<double>& distances,
                                   const Level& level) {
  constexpr double kWeight = 10.0 / kPerFactor;  // of a sample on the surface
  constexpr double kLeastW = 1e-6;               // map units: at the centre itself F is infinite
  const auto points = points_at_centers(map);
  MisplacedFactors misplaced;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto& [c, exponent] = map.factors[i / kPerFactor];
    const double side = distances[i] < 0 ? -1 : 1;
    const bool is_misplaced = std::abs(distances[i]) >= level.band && exponent * side > 0;
    if (!is_misplaced || std::abs(c.w - map.slice) < kLeastW) continue;
    misplaced.factors.push_back(i / kPerFactor);
    misplaced.samples.add(points[i], kWeight / level.samples, side * level.band, side);
  }
  return misplaced;
}

std::optional<RationalMap> lifted(const RationalMap& map, const MisplacedFactors& misplaced,
                                  const std::vector<double>& field) {
  const auto& [samples, factors] = misplaced;
  std::vector<double> square(map.factors.size(), 0);  // of the wanted distance from the slice
  for (std::size_t i = 0; i < factors.size(); ++i) {
    if (samples.side[i] * field[i] >= 0) continue;
    const auto& [c, exponent] = map.factors[factors[i]];
    const Eigen::Vector3d beside = samples.position[i] - Eigen::Vector3d(c.x, c.y, c.z);
    const double w = c.w - map.slice;
    const double grown = std::exp(2 * (samples.target[i] - field[i]) / exponent);
    double& wanted = square[factors[i]];
    wanted = std::max(wanted, grown * (beside.squaredNorm() + w * w) - beside.squaredNorm());
  }
  std::optional<RationalMap> result;
  for (std::size_t k = 0; k < square.size(); ++k) {
    if (square[k] == 0) continue;
    if (!result) result = map;
    double& w = result->factors[k].center.w;
    w = map.slice + std::copysign(std::sqrt(square[k]), w - map.slice);
  }
  return result;
}

}  // namespace qjulia::fitting
