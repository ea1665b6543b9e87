#include "check/label_check.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/random.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/field.hpp"

namespace qjulia::check {
namespace {

constexpr std::size_t kCheckedPoints = 20000;

/// Where |F_1 − L| < 1: random points of the box, led to the surface by Newton's steps along the
/// gradient, each to a value of its own.
std::vector<Quaternion> points_near_surface(const Field& field, const Map& map, const Box& box) {
  base::Random random(1);
  const auto uniform = [&](double low, double high) {
    return std::lerp(low, high, random.uniform());
  };
  std::vector<Quaternion> points(kCheckedPoints);
  std::vector<double> wanted(kCheckedPoints);
  for (std::size_t i = 0; i < kCheckedPoints; ++i) {
    points[i] = {uniform(box.low.x(), box.high.x()), uniform(box.low.y(), box.high.y()),
                 uniform(box.low.z(), box.high.z()), map.dynamics.slice};
    wanted[i] = map.dynamics.surface_level + uniform(-1, 1);
  }
  constexpr int kSteps = 12;
  constexpr double kLongest = 0.3;  // map units
  for (int step = 0; step < kSteps; ++step) {
    const auto values = field.at(points);
    const auto gradients = field.gradient_at(points);
    for (std::size_t i = 0; i < kCheckedPoints; ++i) {
      Quaternion g = gradients[i];
      g.w = 0;
      const double slope = norm(g);
      if (!(slope > 0) || !std::isfinite(slope)) continue;
      const double length = std::clamp((wanted[i] - values[i]) / slope, -kLongest, kLongest);
      points[i] = points[i] + (length / slope) * g;
    }
  }
  const auto values = field.at(points);
  std::vector<Quaternion> near;
  for (std::size_t i = 0; i < kCheckedPoints; ++i) {
    if (std::abs(values[i] - map.dynamics.surface_level) < 1) near.push_back(points[i]);
  }
  return near;
}

}  // namespace

LabelCheck compare_precisions(const Device& device, const Map& map, int iterations,
                              const std::stop_token& stop) {
  const StopRadii stops = find_stop_radii(device, map, {}, stop);
  Box box;
  if (map.frame.box) {
    box = map.frame.shape_to_map.to_map(*map.frame.box);
  } else {
    const double reach = std::min(stops.outer, stops.escape);
    box = {Eigen::Vector3d::Constant(-reach), Eigen::Vector3d::Constant(reach)};
  }
  const Field single(device, map, Precision::single, stops, stop);
  const Field twice(device, map, Precision::dbl, stops, stop);
  const auto points = points_near_surface(single, map, box);
  if (points.empty()) throw InputError("the map has no surface in its box");
  const auto a = single.decided_at(points, iterations);
  const auto b = twice.decided_at(points, iterations);
  LabelCheck check{points.size(), 0, iterations};
  for (std::size_t i = 0; i < a.size(); ++i) {
    if ((a[i] < map.dynamics.surface_level) != (b[i] < map.dynamics.surface_level))
      ++check.different;
  }
  return check;
}

}  // namespace qjulia::check
