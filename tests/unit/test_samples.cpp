// Where samples and factors are put about a sphere.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cmath>

#include "fit/placement.hpp"
#include "fit/random_point.hpp"
#include "fit/sample_weights.hpp"
#include "sphere_pool.hpp"

using namespace qjulia;
using test::small_level;
using test::sphere_pool;

TEST_CASE("a stage's samples have the shares, targets and sides it asks for") {
  const auto pool = sphere_pool(5000);
  fitting::Level level = small_level();
  level.samples = 1000;
  base::Random random(3);
  const auto samples = pool.draw(level, random);
  REQUIRE(samples.size() == 1000);
  std::size_t surface = 0;
  std::size_t band = 0;
  std::size_t beyond = 0;
  std::size_t deep = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double d = samples.position[i].norm() - 1;
    if (samples.side[i] != 0) {
      ++beyond;
      CHECK(std::abs(d) >= 0.1 - 1e-12);
      deep += d < -0.25 ? 1 : 0;  // of the pool `deep` alone, but for a few `around`
      CHECK(samples.target[i] == samples.side[i] * 0.1);
      CHECK(samples.side[i] * d > 0);
      CHECK(samples.weight[i] == Catch::Approx(0.001));
    } else if (std::abs(d) < 1e-12) {
      ++surface;
      CHECK(samples.target[i] == 0);
    } else {
      ++band;
      CHECK(samples.target[i] == Catch::Approx(d).margin(1e-12));
      CHECK(samples.weight[i] == Catch::Approx(0.0005));
    }
  }
  CHECK(surface == 500);
  CHECK(band == 350);
  CHECK(beyond == 150);
  CHECK(deep > 35);  // about a third, less what of it is close to the surface
  base::Random same(3);
  CHECK(pool.draw(level, same).position == samples.position);

  // Off the slice: a ball of 1.2 inradii.
  level.off_slice_weight = 0.25;
  const auto more = pool.draw(level, same);
  REQUIRE(more.size() == 1080);
  int within = 0;
  for (std::size_t i = 0; i < more.size(); ++i) {
    CHECK((more.off_slice[i] != 0) == (i >= 1000));
    if (more.off_slice[i] == 0) continue;
    const double d = std::hypot(more.position[i].norm(), more.off_slice[i]) - 1.2;
    CHECK((std::abs(more.off_slice[i]) >= 0.3 || d < -0.3));
    CHECK(more.side[i] * d > 0);
    CHECK(more.target[i] == Catch::Approx(std::clamp(d, -0.1, 0.1)).margin(1e-12));
    CHECK(more.weight[i] == Catch::Approx(0.00025));
    within += d < 0 ? 1 : 0;
  }
  CHECK(within > 20);
  CHECK(within < 60);

  level.off_slice_weight = 0;
  level.loss = energy::Loss::tanh;
  const auto sided = pool.draw(level, random);
  double inside = 0;
  double outside = 0;
  band = 0;
  for (std::size_t i = 0; i < sided.size(); ++i) {
    const double d = sided.position[i].norm() - 1;
    CHECK(sided.side[i] * d > 0);
    CHECK(sided.target[i] == 0);
    band += std::abs(d) < 0.1 ? 1 : 0;
    (sided.side[i] < 0 ? inside : outside) += sided.weight[i];
  }
  CHECK(inside == Catch::Approx(0.5));
  CHECK(outside == Catch::Approx(0.5));
  CHECK(band == 875);
}

TEST_CASE("monopoles on a sphere make its electrostatic field") {
  const auto pool = sphere_pool(6000);
  const auto map = fitting::place_monopoles(pool, 40, 1);
  REQUIRE(map.dynamics.factors.size() == 40);
  for (const auto& [c, exponent] : map.dynamics.factors)
    CHECK(norm(c) == Catch::Approx(1).margin(1e-9));
  // Outside, as the charge of a conductor at the centre: r Σ a / |x − c| is the same everywhere.
  double low = 1e300;
  double high = -1e300;
  for (const double r : {1.3, 1.6, 1.9}) {
    for (const Eigen::Vector3d& u : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 0.6, -0.8)}) {
      double sum = 0;
      for (const auto& [c, exponent] : map.dynamics.factors) {
        sum += exponent / (r * u - Eigen::Vector3d(c.x, c.y, c.z)).norm();
      }
      low = std::min(low, r * sum);
      high = std::max(high, r * sum);
    }
  }
  CHECK(low > 0);
  CHECK(high < 1.02 * low);
  CHECK_THROWS_WITH(fitting::place_monopoles({pool.surface, {}, {}}, 40, 1),
                    Catch::Matchers::ContainsSubstring("placement by depth"));
}

TEST_CASE("weights by place keep sums, of either side with the tanh loss, and leave others alone") {
  const auto pool = sphere_pool(5000);
  const auto loss = GENERATE(energy::Loss::distance, energy::Loss::tanh);
  fitting::Level level = small_level();
  level.samples = 1000;
  level.loss = loss;
  if (loss == energy::Loss::distance) level.off_slice_weight = 0.25;
  base::Random random(3);
  const energy::Samples before = pool.draw(level, random);
  const ShapeToMap frame{2, {1, 0, 0}};
  energy::Samples samples = before;
  const auto weight_at = [](const Eigen::Vector3d& x) { return x.z() > 0 ? 5.0 : 1.0; };
  const SampleWeights weights = [&](std::span<const Eigen::Vector3d> points) {
    std::vector<double> all;
    for (const auto& x : points) all.push_back(weight_at(x));
    return all;
  };
  fitting::weigh(samples, weights, frame, loss);
  double sums[2][2] = {};
  double scale[2] = {};
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const bool is_below = loss == energy::Loss::tanh && samples.side[i] < 0;
    if (samples.off_slice[i] != 0) {
      CHECK(samples.weight[i] == before.weight[i]);
      continue;
    }
    sums[is_below][0] += before.weight[i];
    sums[is_below][1] += samples.weight[i];
    // One factor on all weights of a side, beside those asked for.
    const double factor =
        samples.weight[i] / before.weight[i] / weight_at(frame.to_shape(samples.position[i]));
    if (scale[is_below] == 0) scale[is_below] = factor;
    CHECK(factor == Catch::Approx(scale[is_below]));
  }
  CHECK(sums[0][1] == Catch::Approx(sums[0][0]));
  CHECK(sums[1][1] == Catch::Approx(sums[1][0]));
  CHECK(scale[0] < 0.8);
}

TEST_CASE("weights by place leave a side alone whose samples do not count") {
  fitting::Level level = small_level();
  level.loss = energy::Loss::tanh;
  base::Random random(3);
  energy::Samples samples = sphere_pool(5000).draw(level, random);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples.side[i] < 0) samples.weight[i] = 0;
  }
  const auto twice = [](std::span<const Eigen::Vector3d> points) {
    return std::vector<double>(points.size(), 2.0);
  };
  const energy::Samples before = samples;
  fitting::weigh(samples, twice, {2, {1, 0, 0}}, level.loss);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    CHECK(samples.weight[i] == Catch::Approx(before.weight[i]));  // never NaN
  }
}

TEST_CASE("a random point takes its numbers in the order z, y, x with every compiler") {
  base::Random random(3);
  base::Random same(3);
  const Eigen::Vector3d point = fitting::point_in_cube(random, 0.8);
  for (const int axis : {2, 1, 0}) CHECK(point[axis] == same.uniform(-0.8, 0.8));
}
