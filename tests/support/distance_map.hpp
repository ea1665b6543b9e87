#pragma once
/// A map whose modulus is the distance to two balls that overlap, so that it has a crease.

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "exact/distance_grid.hpp"
#include "qjulia/map/map.hpp"
#include "random_maps.hpp"

namespace qjulia::test {

/// Signed distance outside and near the surface; inside, that of the deeper ball.
inline double two_balls(const Eigen::Vector3d& x) {
  return std::min((x - Eigen::Vector3d(0.1, 0, 0)).norm() - 0.7,
                  (x - Eigen::Vector3d(-0.9, 0.3, 0.1)).norm() - 0.45);
}

constexpr double kBallsInradius = 0.7;

inline DistanceModulus two_balls_grid(int resolution = 48) {
  const auto distances = [](std::span<const Eigen::Vector3d> points) {
    std::vector<double> found(points.size());
    std::ranges::transform(points, found.begin(), two_balls);
    return found;
  };
  const Box box{{-1.35, -0.7, -0.7}, {0.8, 0.75, 0.7}};
  return exact::sampled_distance(distances, box, resolution, {});
}

/// Calibrated by hand: L = S = ln 0.75.
inline Map distance_map(double shell = 0.1, int roots = 6) {
  static const DistanceModulus placed = two_balls_grid();
  Map map = random_map(static_cast<std::size_t>(roots), 1, 4, 11);
  for (Factor& factor : map.dynamics.factors) {
    factor.center = {0.4 * factor.center.x, 0.4 * factor.center.y, 0.4 * factor.center.z, 0};
    factor.exponent = std::abs(factor.exponent);
  }
  DistanceModulus modulus = placed;
  modulus.shell = shell;
  modulus.inradius = kBallsInradius;
  map.dynamics.modulus = modulus;
  map.dynamics.log_scale = map.dynamics.surface_level = std::log(0.75);
  map.frame.box = Box{{-1.35, -0.7, -0.7}, {0.8, 0.75, 0.7}};
  map.frame.detail = shell / map.frame.box->diagonal();
  map.frame.inradius = kBallsInradius;
  return map;
}

}  // namespace qjulia::test
