#include "armed_ball.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "random_maps.hpp"

namespace qjulia::test {
namespace {

using Eigen::Vector3d;

struct Arm {
  Vector3d tip;
  double radius;
};

const std::array<Arm, 3>& arms() {
  static const std::array<Arm, 3> all = {
      {{{1.3, 0.5, 0}, 0.18}, {{-1.0, 0.9, 0.5}, 0.2}, {{0, -1.1, -0.6}, 0.3}}};
  return all;
}

Vector3d random_point(std::mt19937_64& random, double reach) {
  const double x = uniform(random, -reach, reach);
  const double y = uniform(random, -reach, reach);
  const double z = uniform(random, -reach, reach);
  return {x, y, z};
}

Vector3d distance_gradient(const Vector3d& x) {
  constexpr double kStep = 1e-5;
  Vector3d g;
  for (int i = 0; i < 3; ++i) {
    const Vector3d step = kStep * Vector3d::Unit(i);
    g[i] = (armed_ball_distance(x + step) - armed_ball_distance(x - step)) / (2 * kStep);
  }
  return g;
}

/// `count` of `points`, each the one farthest from those before it.
std::vector<Vector3d> farthest_points(const std::vector<Vector3d>& points, std::size_t count) {
  std::vector<double> distance(points.size(), 1e9);
  std::vector<Vector3d> chosen;
  std::size_t next = 0;
  while (chosen.size() < count) {
    chosen.push_back(points[next]);
    for (std::size_t i = 0; i < points.size(); ++i) {
      distance[i] = std::min(distance[i], (points[i] - chosen.back()).norm());
    }
    next = static_cast<std::size_t>(std::ranges::max_element(distance) - distance.begin());
  }
  return chosen;
}

}  // namespace

double armed_ball_distance(const Vector3d& x) {
  double distance = x.norm() - 0.75;
  for (const auto& [tip, radius] : arms()) {
    const double along = std::clamp(x.dot(tip) / tip.squaredNorm(), 0.0, 1.0);
    distance = std::min(distance, (x - along * tip).norm() - radius);
  }
  return distance;
}

std::vector<Vector3d> armed_ball_surface(std::size_t count) {
  std::mt19937_64 random(3);
  std::vector<Vector3d> points;
  while (points.size() < count) {
    Vector3d x = random_point(random, 1.7);
    // Only from close by, so that all parts of the surface get about as many.
    if (std::abs(armed_ball_distance(x)) > 0.1) continue;
    for (int step = 0; step < 6; ++step) x -= armed_ball_distance(x) * distance_gradient(x);
    if (std::abs(armed_ball_distance(x)) < 1e-6) points.push_back(x);
  }
  return points;
}

Map armed_ball_map(int factors) {
  const std::vector<Vector3d> surface = armed_ball_surface(3000);
  const double offset = 0.16 * std::sqrt(331.0 / factors);
  Map map;
  map.dynamics.factors.push_back({{0, 0, 0, 0}, 0});
  for (const Vector3d& x : farthest_points(surface, static_cast<std::size_t>(factors - 1))) {
    const double side = map.dynamics.factors.size() % 2 == 0 ? 1 : -1;
    const Vector3d c = x + side * offset * distance_gradient(x);
    map.dynamics.factors.push_back({{c.x(), c.y(), c.z(), 0}, 0});
  }
  // Columns 1, ln |x - c_k| against the distance, at points within 0.15 of the surface.
  const auto samples = static_cast<Eigen::Index>(surface.size());
  Eigen::MatrixXd columns(samples, factors + 1);
  Eigen::VectorXd distances(samples);
  std::mt19937_64 random(5);
  for (Eigen::Index i = 0; i < samples; ++i) {
    const Vector3d x = surface[static_cast<std::size_t>(i)] + random_point(random, 0.15);
    distances[i] = armed_ball_distance(x);
    columns(i, 0) = 1;
    for (int k = 0; k < factors; ++k) {
      const Quaternion& c = map.dynamics.factors[static_cast<std::size_t>(k)].center;
      columns(i, k + 1) = std::log((x - Vector3d(c.x, c.y, c.z)).norm());
    }
  }
  Eigen::MatrixXd normal = columns.transpose() * columns;
  normal.diagonal().array() += 1e-2;
  const Eigen::VectorXd solution = normal.ldlt().solve(columns.transpose() * distances);
  map.dynamics.log_scale = solution[0];
  for (int k = 0; k < factors; ++k) {
    map.dynamics.factors[static_cast<std::size_t>(k)].exponent = solution[k + 1];
  }
  map.frame.inradius = 0.75;
  Box box{surface.front(), surface.front()};
  for (const Vector3d& x : surface) {
    box.low = box.low.cwiseMin(x);
    box.high = box.high.cwiseMax(x);
  }
  map.frame.box = box;
  return map;
}

}  // namespace qjulia::test
