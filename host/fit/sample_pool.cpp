#include "fit/sample_pool.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "fit/random_point.hpp"

namespace qjulia::fitting {
namespace {

// Points for a fit of kEvaluations or more whose stages draw up to kSamples of them.
constexpr double kSurfacePoints = 200'000;
constexpr double kNearPoints = 240'000;
constexpr double kAroundPoints = 80'000;
constexpr double kBoxPoints = 40'000;  // in the shape's box; those deep in the shape are kept
constexpr double kEvaluations = 1500;
constexpr double kSamples = 40'000;
constexpr double kLeastShare = 0.125;
constexpr double kNarrowOffset = 0.08;  // map units: two cells of 4/97
constexpr double kWideOffset = 0.25;
constexpr double kDeep = 0.1;             // map units: more than any band of the built-in schedules
constexpr std::size_t kFewestDeep = 100;  // that may stand for a thin shape's inside
constexpr double kReach = 2.0;  // half the side of the cube about the shape that `around` fills

std::vector<DistancePoint> measured(const SignedDistance& distance,
                                    const std::vector<Eigen::Vector3d>& points,
                                    const std::stop_token& stop) {
  const auto distances = distance.at(points, stop);
  std::vector<DistancePoint> measured(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) measured[i] = {points[i], distances[i]};
  return measured;
}

double side_of(double distance) { return distance < 0 ? -1 : 1; }

/// Scales the weights so that those of either side sum to ½, given numbers of the sides' signs.
void balance(Samples& samples, const std::vector<double>& signs) {
  double sums[2] = {0, 0};
  for (std::size_t i = 0; i < samples.size(); ++i) {
    sums[signs[i] < 0] += samples.weight[i];
  }
  for (std::size_t i = 0; i < samples.size(); ++i) {
    samples.weight[i] *= 0.5 / sums[signs[i] < 0];
  }
}

/// Adds points in random directions of the four-dimensional space. Half of them lie within one and
/// a half times the ball's radius from the origin, the others between half of it and the pool's
/// reach. Iterates land in all directions: where the set off the slice is a ball, they stay or
/// leave by their distance from the origin alone.
void add_off_slice(const Level& level, double inradius, base::Random& random, Samples& samples) {
  constexpr double kShare = 0.08;
  constexpr double kBall = 1.2;
  constexpr double kLeastW = 0.3;  // beyond kInner the slice is the shape's
  constexpr double kInner = 0.9;   // all in inradii
  const double ball = kBall * inradius;
  const auto count = static_cast<int>(kShare * level.samples);
  for (int i = 0; i < count; ++i) {
    const bool is_near = random.index(2) == 0;
    const double nearest = is_near ? 0 : 0.5 * ball;
    const double farthest = is_near ? 1.5 * ball : std::max(kReach, 1.5 * ball);
    Eigen::Vector4d q;
    do {
      Eigen::Vector4d u;
      do {
        for (double& coordinate : u) coordinate = random.uniform(-1, 1);
      } while (u.norm() > 1);
      q = random.uniform(nearest, farthest) * u.normalized();
    } while (std::abs(q[3]) < kLeastW * inradius && q.norm() > kInner * inradius);
    const double d = q.norm() - ball;
    samples.add(q.head<3>(), level.off_slice_weight, std::clamp(d, -level.band, level.band),
                side_of(d), q[3]);
  }
}

}  // namespace

SamplePool make_sample_pool(const Shape& shape, const SignedDistance& distance, std::uint64_t seed,
                            int evaluations, int samples, const std::stop_token& stop) {
  const double share =
      std::clamp(evaluations / kEvaluations, kLeastShare, 1.0) * std::max(1.0, samples / kSamples);
  const auto points_of = [share](double all) { return static_cast<std::size_t>(share * all); };
  SamplePool pool;
  pool.inradius = shape.inradius;
  pool.surface = sample_surface(shape.mesh, points_of(kSurfacePoints), seed);
  base::Random random(seed);
  std::vector<Eigen::Vector3d> points(points_of(kNearPoints));
  for (auto& x : points) {
    const auto& [position, normal] = pool.surface[random.index(pool.surface.size())];
    const double width = random.index(2) == 0 ? kNarrowOffset : kWideOffset;
    x = position + random.uniform(-width, width) * normal;
  }
  pool.near = measured(distance, points, stop);
  const Eigen::Vector3d center = shape.mesh.box().center();
  points.resize(points_of(kAroundPoints));
  for (auto& x : points) {
    x = center + point_in_cube(random, kReach);
  }
  pool.around = measured(distance, points, stop);
  points.resize(points_of(kBoxPoints));
  const Box box = shape.mesh.box();
  for (auto& x : points) {
    for (int axis = 0; axis < 3; ++axis) x[axis] = random.uniform(box.low[axis], box.high[axis]);
  }
  pool.deep = measured(distance, points, stop);
  std::erase_if(pool.deep, [](const DistancePoint& p) { return p.distance > -kDeep; });
  return pool;
}

Samples SamplePool::draw(const Level& level, base::Random& random) const {
  const auto total = static_cast<std::size_t>(level.samples);
  const double b = level.band;
  Samples samples;
  // Rejection from a pool, by a bounded number of tries. The pools hold enough of either kind for
  // the built-in schedules.
  const auto draw_from = [&](const std::vector<DistancePoint>& from, auto wanted) {
    constexpr int kTries = 1000;
    for (int t = 0; t < kTries; ++t) {
      const DistancePoint& p = from[random.index(from.size())];
      if (wanted(p)) return p;
    }
    return from[random.index(from.size())];
  };
  const auto within = [b](const DistancePoint& q) { return std::abs(q.distance) < b; };
  const auto beyond = [b](const DistancePoint& q) { return std::abs(q.distance) >= b; };
  if (level.loss == Loss::tanh) {
    for (std::size_t i = 0; i < total; ++i) {
      const auto p = i % 8 != 0 ? draw_from(near, within) : draw_from(around, beyond);
      samples.add(p.position, 1, 0, side_of(p.distance));
    }
    balance(samples, samples.side);
    return samples;
  }
  const std::size_t on_surface = total / 2;
  const std::size_t in_band = total * 35 / 100;
  for (std::size_t i = 0; i < on_surface; ++i) {
    samples.add(surface[random.index(surface.size())].position, 1, 0, 0);
  }
  for (std::size_t i = 0; i < in_band; ++i) {
    const auto p = draw_from(near, within);
    samples.add(p.position, level.band_weight, p.distance, 0);
  }
  const std::array pools{&near, &around, deep.size() < kFewestDeep ? &around : &deep};
  for (std::size_t i = on_surface + in_band; i < total; ++i) {
    const auto p = draw_from(*pools[random.index(pools.size())], beyond);
    samples.add(p.position, 1, std::clamp(p.distance, -b, b), side_of(p.distance));
  }
  if (level.off_slice_weight > 0) add_off_slice(level, inradius, random, samples);
  for (double& w : samples.weight) w /= static_cast<double>(total);
  return samples;
}

Samples grid_samples(const Shape& shape, const SignedDistance& distance, const Level& level,
                     const std::stop_token& stop) {
  const double cell = 2 * kReach / level.samples;
  const Eigen::Vector3d first =
      shape.mesh.box().center() - Eigen::Vector3d::Constant(kReach - cell / 2);
  std::vector<Eigen::Vector3d> points;
  for (int k = 0; k < level.samples; ++k) {
    for (int j = 0; j < level.samples; ++j) {
      for (int i = 0; i < level.samples; ++i)
        points.push_back(first + cell * Eigen::Vector3d(i, j, k));
    }
  }
  const auto distances = distance.at(points, stop);
  Samples samples;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double d = distances[i];
    const bool by_side = level.loss == Loss::tanh;
    samples.add(points[i], 1 / std::max(std::abs(d), cell / 2), by_side ? 0 : d,
                by_side ? side_of(d) : 0);
  }
  balance(samples, distances);
  return samples;
}

}  // namespace qjulia::fitting
