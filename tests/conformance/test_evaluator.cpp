// The device's energy, gradient and Gauss-Newton matrix against the reference's, which shares no
// code and no method with them.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cmath>

#include "base/larger_error.hpp"
#include "device/quirks.hpp"
#include "energy/evaluator.hpp"
#include "random_maps.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

Map map_off_slice() {
  Map map = test::random_map(13, 0.1, 0.6, 61);
  map.dynamics.slice = 0.07;
  map.dynamics.phase = {0.5, 0.5, -0.5, 0.5};
  map.dynamics.factors[2].center = {0.5, 0, 0, 0.07};
  return map;
}

/// Random samples, every fourth off the slice, and some beside a factor and beside its branch cut.
energy::Samples hard_samples(const Map& map) {
  energy::Samples samples = test::random_samples(150, 62);
  for (std::size_t i = 0; i < samples.size(); i += 4) {
    samples.off_slice[i] = 0.01 * static_cast<double>(i) - 0.7;
  }
  const Quaternion& c = map.dynamics.factors[2].center;
  for (const double step : {1e-3, 1e-2}) {
    samples.add({c.x + step, c.y, c.z + step}, 0.01, 0.1, 0);  // near the factor
    samples.add({c.x - 0.7, c.y + step, c.z}, 0.01, -0.1, 1);  // near its cut
    samples.add({c.x - 0.7, c.y, c.z - step}, 0.01, 0.1, -1);
  }
  return samples;
}

double relative_difference(const std::vector<double>& a, const std::vector<double>& b) {
  REQUIRE(a.size() == b.size());
  double worst = 0;
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    worst = base::larger_error(worst, std::abs(a[i] - b[i]));
    largest = std::max(largest, std::abs(b[i]));
  }
  return worst / largest;
}

}  // namespace

TEST_CASE("energy, field and gradient on the device are the reference's") {
  const int iterations = GENERATE(1, 2, 3, 4);
  const auto [name, loss] = GENERATE(from_range(energy::kLosses.begin(), energy::kLosses.end()));
  const Map map = map_off_slice();
  const energy::Samples samples = hard_samples(map);
  const energy::EnergySettings options{loss, iterations, 1.3, 20};
  const auto reference = energy::make_reference_evaluator(samples, options);
  const auto expected = reference->evaluate(map, true);
  const auto expected_field = reference->field(map);
  for (const test::Variant& variant : test::variants()) {
    const auto device = variant.of(test::shared_device());
    CAPTURE(variant, iterations, name);
    if (test::can_check(device, Precision::dbl)) {
      const auto in_double =
          energy::make_device_evaluator(device, samples, options, Precision::dbl);
      const auto two = in_double->evaluate(map, true);
      CHECK(two.energy == Catch::Approx(expected.energy).epsilon(1e-10));
      CHECK(relative_difference(two.gradient, expected.gradient) < 1e-10);
      CHECK(relative_difference(in_double->field(map), expected_field) < 1e-10);
    }
    const auto one = energy::make_device_evaluator(device, samples, options)->evaluate(map, true);
    CHECK(one.energy == Catch::Approx(expected.energy).epsilon(1e-5));
    CHECK(relative_difference(one.gradient, expected.gradient) < 1e-4);
  }
}

TEST_CASE("orbits that leap far out beside others that stay leave the gradient finite") {
  // F_1 = 60 ln |x|, nearly: about 0 on the unit sphere, 28 at radius 1.6, where the versors of
  // many factors must not spoil what nothing is asked of.
  Map map = test::random_map(200, 0.5, 1, 63);
  map.dynamics.log_scale = 0;
  for (Factor& factor : map.dynamics.factors) factor.center = 1e-3 * factor.center;
  map.dynamics.factors.push_back({{0, 0, 0, 1e-3}, 60 - map.dynamics.degree()});
  energy::Samples samples;
  for (int i = 0; i < 64; ++i) {
    const double radius = i % 2 == 0 ? 0.995 : 1.6;
    const Eigen::Vector3d x(std::cos(i), std::sin(i) * std::cos(2 * i),
                            std::sin(i) * std::sin(2 * i));
    samples.add(radius * x, 1.0 / 64, 0.1, 0);
  }
  const energy::EnergySettings options{energy::Loss::distance, 3, 1, 20};
  const auto expected = energy::make_reference_evaluator(samples, options)->evaluate(map, true);
  for (const test::Variant& variant : test::variants()) {
    CAPTURE(variant);
    const auto device = variant.of(test::shared_device());
    const auto found = energy::make_device_evaluator(device, samples, options, Precision::single)
                           ->evaluate(map, true);
    CHECK(found.energy == Catch::Approx(expected.energy).epsilon(1e-4));
    CHECK(relative_difference(found.gradient, expected.gradient) < 1e-3);
  }
}

TEST_CASE("the Gauss-Newton matrix on the device is the reference's") {
  const auto [name, loss] = GENERATE(from_range(energy::kLosses.begin(), energy::kLosses.end()));
  const int iterations = GENERATE(1, 2);
  const Map map = map_off_slice();
  const energy::Samples samples = hard_samples(map);
  const energy::EnergySettings options{loss, iterations, 1.3, 20};
  const auto expected = energy::make_reference_evaluator(samples, options)->gauss_newton(map);
  const double size = expected.cwiseAbs().maxCoeff();
  for (const test::Variant& variant : test::variants()) {
    const auto device = variant.of(test::shared_device());
    CAPTURE(variant, name, iterations);
    if (test::can_check(device, Precision::dbl)) {
      const auto two = energy::make_device_evaluator(device, samples, options, Precision::dbl)
                           ->gauss_newton(map);
      CHECK((two - expected).cwiseAbs().maxCoeff() < 1e-10 * size);
    }
    const auto one = energy::make_device_evaluator(device, samples, options)->gauss_newton(map);
    CHECK((one - expected).cwiseAbs().maxCoeff() < 1e-4 * size);
  }
}

TEST_CASE("blocks of the Gauss-Newton matrix on the device are the reference's") {
  const auto [name, loss] = GENERATE(from_range(energy::kLosses.begin(), energy::kLosses.end()));
  // Blocks of one factor, padded ones, and such as fill three tiles; more coarse variables than two
  // tiles have room for.
  const auto [factors, most] =
      GENERATE(table<std::size_t, std::size_t>({{13, 1}, {13, 5}, {13, 13}, {80, 45}}));
  Map map = test::random_map(factors, 0.1, 0.6, 64);
  map.dynamics.slice = 0.1;
  // Hard ones, and so many more that panels are filled twice.
  energy::Samples samples = hard_samples(map);
  const energy::Samples more = test::random_samples(1000, 65);
  for (std::size_t i = 0; i < more.size(); ++i) samples.add(more, i);
  const energy::EnergySettings options{loss, 1, 1.3, 20};
  const auto blocks = energy::neighbour_blocks(map, most);
  const auto expected =
      energy::make_reference_evaluator(samples, options)->gauss_newton_blocks(map, blocks);
  for (const test::Variant& variant : test::variants()) {
    const auto device = variant.of(test::shared_device());
    CAPTURE(variant, name, factors, most);
    const auto check = [&](Precision precision, double tolerance) {
      const auto evaluator = energy::make_device_evaluator(device, samples, options, precision);
      evaluator->gauss_newton(map);  // it may share buffers of another order
      const auto found = evaluator->gauss_newton_blocks(map, blocks);
      CHECK(found.blocks == blocks);
      REQUIRE(found.own.size() == expected.own.size());
      const auto is_near = [&](const Eigen::MatrixXd& one, const Eigen::MatrixXd& other) {
        REQUIRE(one.rows() == other.rows());
        CHECK(one.allFinite());
        CHECK((one - other).cwiseAbs().maxCoeff() < tolerance * other.cwiseAbs().maxCoeff());
      };
      for (std::size_t b = 0; b < blocks.size(); ++b) is_near(found.own[b], expected.own[b]);
      is_near(found.coarse, expected.coarse);
      CHECK(evaluator->gauss_newton_blocks(map, blocks).coarse == found.coarse);
    };
    if (test::can_check(device, Precision::dbl)) check(Precision::dbl, 1e-10);
    check(Precision::single, 1e-4);
  }
}

TEST_CASE("the Gauss-Newton diagonal on the device is the reference's") {
  const auto [name, loss] = GENERATE(from_range(energy::kLosses.begin(), energy::kLosses.end()));
  const int iterations = GENERATE(1, 2);
  const Map map = map_off_slice();
  const energy::Samples samples = hard_samples(map);
  const energy::EnergySettings options{loss, iterations, 1.3, 20};
  const auto expected =
      energy::make_reference_evaluator(samples, options)->gauss_newton_diagonal(map);
  const auto difference = [&](const Eigen::VectorXd& diagonal) {
    return ((diagonal - expected).cwiseAbs().array() / (expected.array() + 1e-300)).maxCoeff();
  };
  for (const test::Variant& variant : test::variants()) {
    const auto device = variant.of(test::shared_device());
    CAPTURE(variant, name, iterations);
    if (test::can_check(device, Precision::dbl)) {
      CHECK(difference(energy::make_device_evaluator(device, samples, options, Precision::dbl)
                           ->gauss_newton_diagonal(map)) < 1e-10);
    }
    CHECK(difference(
              energy::make_device_evaluator(device, samples, options)->gauss_newton_diagonal(map)) <
          1e-4);
  }
}

TEST_CASE("a sample on a factor's centre leaves the Gauss-Newton diagonal finite") {
  Map map = map_off_slice();
  map.dynamics.slice = 0;
  energy::Samples samples = test::random_samples(300, 63);
  for (std::size_t k = 0; k < 5; ++k) {
    const Eigen::Vector3d& x = samples.position[7 * k];
    map.dynamics.factors[k].center = {x.x(), x.y(), x.z(), 0};
  }
  std::ranges::fill(samples.off_slice, 0);
  for (const test::Variant& variant : test::variants()) {
    const auto diagonal =
        energy::make_device_evaluator(variant.of(test::shared_device()), samples, {})
            ->gauss_newton_diagonal(map);
    CAPTURE(variant);
    CHECK(diagonal.allFinite());
  }
}

TEST_CASE("an evaluator of iterates has room for the diagonal, of more rows than orbits have") {
  const Map map = map_off_slice();
  const energy::Samples samples = test::random_samples(20'000, 62);
  for (const test::Variant& variant : test::variants()) {
    const Device device = variant.of(test::shared_device());
    const auto diagonal = [&](int orbit_items) {
      Tuning tuning = device.tuning(Precision::single);
      tuning.orbit_items = orbit_items;
      const Device tuned = device.with_tuning(Precision::single, tuning);
      return energy::make_device_evaluator(tuned, samples, {energy::Loss::tanh, 2, 1.3, 20})
          ->gauss_newton_diagonal(map);
    };
    const Eigen::VectorXd expected = diagonal(4096);  // rows enough for both
    CAPTURE(variant);
    CHECK(diagonal(1) == expected);
    CHECK(diagonal(64) == expected);
  }
}

TEST_CASE("work-items that sum in local memory give the reference's sums, the same every time") {
  if (device::may_miscompile_barriers(test::shared_device().info())) {
    WARN("this PoCL compiles these groups rightly or wrongly by chance (docs/lab/drivers.md)");
    return;
  }
  const int iterations = GENERATE(2, 4);
  const Map map = map_off_slice();
  const energy::Samples samples = hard_samples(map);
  const energy::EnergySettings options{energy::Loss::tanh, iterations, 1.3, 20};
  const auto expected = energy::make_reference_evaluator(samples, options)->evaluate(map, true);
  const auto expected_matrix =
      energy::make_reference_evaluator(samples, {energy::Loss::distance, 1, 1.3, 20})
          ->gauss_newton(map);
  const double size = expected_matrix.cwiseAbs().maxCoeff();
  for (const int width : test::lane_widths()) {
    // GPUs have one lane and 32 KiB of local memory: wide lanes get a small group.
    const int group = width == 1 ? 16 : 3;
    if (width > 1 && iterations > 2) continue;
    const auto check = [&](Precision precision, double energy, double gradient, double matrix) {
      auto device = test::shared_device().with_lane_width(width);
      if (!test::can_check(device, precision)) return;
      Tuning tuning = device.tuning(precision);
      tuning.orbit_group = group;
      tuning.orbit_items = 2;  // so that a group takes several turns, the last not full
      tuning.product_side = 16;
      device = device.with_tuning(precision, tuning);
      CAPTURE(width, group, iterations, precision == Precision::dbl);
      const auto evaluator = energy::make_device_evaluator(device, samples, options, precision);
      const auto found = evaluator->evaluate(map, true);
      CHECK(found.energy == Catch::Approx(expected.energy).epsilon(energy));
      CHECK(relative_difference(found.gradient, expected.gradient) < gradient);
      CHECK(evaluator->evaluate(map, true).gradient == found.gradient);
      const auto h = energy::make_device_evaluator(device, samples,
                                                   {energy::Loss::distance, 1, 1.3, 20}, precision)
                         ->gauss_newton(map);
      CHECK((h - expected_matrix).cwiseAbs().maxCoeff() < matrix * size);
    };
    check(Precision::dbl, 1e-10, 1e-10, 1e-10);
    check(Precision::single, 1e-5, 1e-4, 1e-4);
  }
}

TEST_CASE("the products of matching pursuit on the device are the reference's") {
  const auto [name, loss] = GENERATE(from_range(energy::kLosses.begin(), energy::kLosses.end()));
  const int iterations = GENERATE(1, 2);
  const Map map = map_off_slice();
  const energy::Samples samples = hard_samples(map);
  const energy::EnergySettings options{loss, iterations, 1.3, 20};
  std::vector<Quaternion> centers;
  for (const auto& factor : test::random_map(37, 0.1, 0.6, 9).dynamics.factors) {
    centers.push_back(factor.center);
  }
  const auto expected =
      energy::make_reference_evaluator(samples, options)->pursuit_products(map, centers);
  REQUIRE(expected.rows() == 39);
  const double size = expected.cwiseAbs().maxCoeff();
  for (const test::Variant& variant : test::variants()) {
    const auto device = variant.of(test::shared_device());
    CAPTURE(variant, name, iterations);
    const auto difference = [&](Precision precision) {
      const auto evaluator = energy::make_device_evaluator(device, samples, options, precision);
      // Between two matrices of another order, whose buffers it may share.
      evaluator->gauss_newton(map);
      const auto found = evaluator->pursuit_products(map, centers);
      return (found - expected).cwiseAbs().maxCoeff() / size;
    };
    if (test::can_check(device, Precision::dbl)) CHECK(difference(Precision::dbl) < 1e-10);
    CHECK(difference(Precision::single) < 1e-4);
  }
}
