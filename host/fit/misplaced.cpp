#include "fit/misplaced.hpp"

#include <algorithm>
#include <cmath>

namespace qjulia::fitting {
namespace {

constexpr std::size_t kPerFactor = 7;  // points
constexpr double kLeastGap = 1e-6;     // map units: at a centre in the slice F is infinite

}  // namespace

std::vector<Eigen::Vector3d> points_at_centers(const Map& map) {
  std::vector<Eigen::Vector3d> points;
  for (const auto& [c, exponent] : map.dynamics.factors) {
    const Eigen::Vector3d center(c.x, c.y, c.z);
    points.push_back(center);
    for (int axis = 0; axis < 3; ++axis) {
      const double length = std::max(std::abs(c.w - map.dynamics.slice), 10 * kLeastGap);
      const Eigen::Vector3d step = length * Eigen::Vector3d::Unit(axis);
      points.emplace_back(center + step);
      points.emplace_back(center - step);
    }
  }
  return points;
}

MisplacedFactors misplaced_factors(const Map& map, const std::vector<double>& distances,
                                   const Level& level) {
  constexpr double kWeight = 10.0 / kPerFactor;  // a surface sample's
  const auto points = points_at_centers(map);
  const auto is_misplaced = [&](std::size_t point) {
    const double d = distances[point];
    return std::abs(d) >= level.band && map.dynamics.factors[point / kPerFactor].exponent * d > 0;
  };
  MisplacedFactors misplaced;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::size_t k = i / kPerFactor;
    const std::size_t center = k * kPerFactor;
    if (!is_misplaced(center) || !is_misplaced(i)) continue;
    if (i == center && std::abs(map.dynamics.factors[k].center.w - map.dynamics.slice) < kLeastGap)
      continue;
    const double side = distances[i] < 0 ? -1 : 1;
    misplaced.factors.push_back(k);
    misplaced.samples.add(points[i], kWeight / level.samples, side * level.band, side);
  }
  return misplaced;
}

std::optional<Map> lifted(const Map& map, const MisplacedFactors& misplaced,
                          const std::vector<double>& field) {
  // Map units. A factor that had to go farther is too weak to make the hole: another one does.
  constexpr double kFarthest = 0.5;
  const auto& [samples, factors] = misplaced;
  std::vector<double> square(map.dynamics.factors.size(),
                             0);  // squares of the wanted distances from the slice
  for (std::size_t i = 0; i < factors.size(); ++i) {
    if (samples.side[i] * field[i] >= 0) continue;
    const auto& [c, exponent] = map.dynamics.factors[factors[i]];
    const double w = c.w - map.dynamics.slice;
    const double beside = (samples.position[i] - Eigen::Vector3d(c.x, c.y, c.z)).squaredNorm();
    // F = a/2 ln(beside + W²) + what the other factors add.
    const double grown = std::exp(2 * (samples.target[i] - field[i]) / exponent);
    const double asked = grown * (beside + w * w) - beside;
    double& wanted = square[factors[i]];
    if (asked <= kFarthest * kFarthest) wanted = std::max(wanted, asked);
  }
  std::optional<Map> result;
  for (std::size_t k = 0; k < square.size(); ++k) {
    if (square[k] == 0) continue;
    if (!result) result = map;
    double& w = result->dynamics.factors[k].center.w;
    w = map.dynamics.slice + std::copysign(std::sqrt(square[k]), w - map.dynamics.slice);
  }
  return result;
}

}  // namespace qjulia::fitting
