#include "fit/sample_pool.hpp"

#include <algorithm>
#include <cmath>

namespace qjulia {
namespace {

// Points for a fit of kEvaluations or more; a stage of 60 evaluations draws some 20,000 of them.
constexpr double kSurfacePoints = 200'000;
constexpr double kNearPoints = 240'000;
constexpr double kAroundPoints = 80'000;
constexpr double kEvaluations = 1500;
constexpr double kLeastShare = 0.125;
constexpr double kNarrowOffset = 0.08;  // map units: two cells of 4/97
constexpr double kWideOffset = 0.25;
constexpr double kReach = 2.0;  // the box about the origin's shape that `around` fills

std::vector<DistancePoint> measured(const SignedDistance& distance,
                                    const std::vector<Eigen::Vector3d>& points) {
  const auto distances = distance.at(points);
  std::vector<DistancePoint> measured(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) measured[i] = {points[i], distances[i]};
  return measured;
}

}  // namespace

SamplePool make_sample_pool(const Shape& shape, const SignedDistance& distance, std::uint64_t seed,
                            int evaluations) {
  const double share = std::clamp(evaluations / kEvaluations, kLeastShare, 1.0);
  const auto points_of = [share](double all) { return static_cast<std::size_t>(share * all); };
  SamplePool pool;
  pool.surface = sample_surface(shape.mesh, points_of(kSurfacePoints), seed);
  Random random(seed);
  std::vector<Eigen::Vector3d> points(points_of(kNearPoints));
  for (auto& x : points) {
    const auto& [position, normal] = pool.surface[random.index(pool.surface.size())];
    const double width = random.index(2) == 0 ? kNarrowOffset : kWideOffset;
    x = position + random.uniform(-width, width) * normal;
  }
  pool.near = measured(distance, points);
  const Eigen::Vector3d center = shape.mesh.box().center();
  points.resize(points_of(kAroundPoints));
  for (auto& x : points) {
    x = center + Eigen::Vector3d(random.uniform(-kReach, kReach), random.uniform(-kReach, kReach),
                                 random.uniform(-kReach, kReach));
  }
  pool.around = measured(distance, points);
  return pool;
}

Samples SamplePool::draw(const Phase& phase, Random& random) const {
  const auto total = static_cast<std::size_t>(phase.samples);
  const std::size_t on_surface = total / 2;
  const std::size_t in_band = total * 35 / 100;
  const double b = phase.band;
  Samples samples;
  const auto add_beyond = [&](const DistancePoint& p) {
    const double side = p.distance < 0 ? -1 : 1;
    samples.add(p.position, 1, side * b, side);
  };
  // Rejection from a pool; the pools hold enough of either kind for a bounded number of tries.
  const auto draw_from = [&](const std::vector<DistancePoint>& from, auto wanted) {
    constexpr int kTries = 1000;
    for (int t = 0; t < kTries; ++t) {
      const DistancePoint& p = from[random.index(from.size())];
      if (wanted(p)) return p;
    }
    return from[random.index(from.size())];
  };
  for (std::size_t i = 0; i < on_surface; ++i) {
    samples.add(surface[random.index(surface.size())].position, 1, 0, 0);
  }
  for (std::size_t i = 0; i < in_band; ++i) {
    const auto p =
        draw_from(near, [b](const DistancePoint& q) { return std::abs(q.distance) < b; });
    samples.add(p.position, phase.band_weight, p.distance, 0);
  }
  const auto beyond = [b](const DistancePoint& q) { return std::abs(q.distance) >= b; };
  for (std::size_t i = on_surface + in_band; i < total; ++i) {
    add_beyond(draw_from(i % 2 == 0 ? near : around, beyond));
  }
  for (double& w : samples.weight) w /= static_cast<double>(total);
  return samples;
}

}  // namespace qjulia
