// The public energy: its gradient against central differences, the reference and its own loss.

#include <catch2/catch_all.hpp>
#include <cmath>
#include <limits>

#include "base/larger_error.hpp"
#include "energy/evaluator.hpp"
#include "map_checks.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/energy/energy.hpp"
#include "random_maps.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

constexpr std::size_t kSamples = 61;

Map map_to_fit() {
  Map map = test::random_map(11, 0.1, 0.6, 81);
  map.dynamics.slice = 0.07;
  map.dynamics.phase = {0.5, 0.5, -0.5, 0.5};
  return map;
}

/// Of four dimensions.
EnergySamples samples_in_4d() {
  const energy::Samples random = test::random_samples(kSamples, 82);
  EnergySamples samples;
  samples.points = test::random_points(83, kSamples, 1.4, 0.5);
  samples.targets = random.target;
  samples.sides = random.side;
  samples.weights = random.weight;
  return samples;
}

std::vector<double> energy_gradient(const Energy& energy, const std::vector<double>& x) {
  std::vector<double> gradient(energy.size());
  energy.value_and_gradient(x, gradient);
  return gradient;
}

/// Largest difference from central differences of the value, over the largest component.
double energy_gradient_error(const Energy& energy, const std::vector<double>& x) {
  constexpr double kStep = 2e-7;
  const auto gradient = energy_gradient(energy, x);
  double worst = 0, largest = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    auto up = x, down = x;
    up[i] += kStep;
    down[i] -= kStep;
    const double difference = (energy.value(up) - energy.value(down)) / (2 * kStep);
    worst = base::larger_error(worst, std::abs(difference - gradient[i]));
    largest = std::max(largest, std::abs(difference));
  }
  return worst / largest;
}

EnergyOptions with_loss(EnergyLoss loss, int iterations, Precision precision = Precision::dbl) {
  EnergyOptions options;
  options.loss = loss;
  options.iterations = iterations;
  options.precision = precision;
  return options;
}

/// A loss that is none of the library's.
std::pair<double, double> quartic(double field, std::size_t sample) {
  const double r = field - 0.01 * static_cast<double>(sample);
  return {0.25 * r * r * r * r, r * r * r};
}

template <class Call>
void refuses_by_name(const char* field, const Call& call) {
  try {
    call();
    FAIL_CHECK("accepts bad " << field);
  } catch (const OptionError& error) {
    CHECK(error.field() == field);
  }
}

}  // namespace

TEST_CASE("gradients of the energy agree with central differences") {
  const int iterations = GENERATE(1, 2, 3, 4);
  const auto loss = GENERATE(EnergyLoss::tanh, EnergyLoss::distance, EnergyLoss::own);
  const auto variant = GENERATE(from_range(test::variants()));
  const Device device = variant.of(test::shared_device());
  if (!test::can_check(device, Precision::dbl)) return;
  EnergyOptions options = with_loss(loss, iterations);
  options.alpha = 1.3;
  options.slice = true;
  if (loss == EnergyLoss::own) options.own = quartic;
  EnergySamples samples = samples_in_4d();
  samples.points[3].x = 1.2 * kUsualEscape;  // its field depends on the slice alone
  const Energy energy(device, map_to_fit(), samples, options);
  CAPTURE(iterations, variant);
  CHECK(energy_gradient_error(energy, energy.unknowns()) < 1e-6);
}

TEST_CASE("an energy whose slice is an unknown has it last, and samples move with it") {
  if (!test::can_check(test::shared_device(), Precision::dbl)) return;
  const int iterations = GENERATE(1, 3);
  const Map map = map_to_fit();
  EnergySamples samples = samples_in_4d();
  EnergyOptions options = with_loss(EnergyLoss::distance, iterations);
  const Energy fixed(test::shared_device(), map, samples, options);
  options.slice = true;
  const Energy energy(test::shared_device(), map, samples, options);
  auto x = energy.unknowns();
  REQUIRE(x.size() == fixed.size() + 1);
  CHECK(energy.size() == x.size());
  CHECK(x.back() == map.dynamics.slice);
  CHECK(energy.value(x) == fixed.value(fixed.unknowns()));
  auto gradient = energy_gradient(energy, x);
  gradient.pop_back();
  CHECK(gradient == energy_gradient(fixed, fixed.unknowns()));
  // Elsewhere it is the energy of samples that have been moved.
  x.back() = 0.3;
  for (Quaternion& point : samples.points) point.w += 0.3 - map.dynamics.slice;
  Map moved = map;
  moved.dynamics.slice = 0.3;
  CHECK(energy.map_at(x).dynamics.slice == 0.3);
  options.slice = false;
  const Energy expected(test::shared_device(), moved, samples, options);
  CHECK(energy.value(x) == Catch::Approx(expected.value(expected.unknowns())).epsilon(1e-12));
  // Beyond what a map may have, it says so without an error.
  x.back() = 1e18;
  CHECK(std::isnan(energy_gradient(energy, x).back()));
}

TEST_CASE("the energy is the reference's") {
  if (!test::can_check(test::shared_device(), Precision::dbl)) return;
  const int iterations = GENERATE(1, 3);
  const Map map = map_to_fit();
  const EnergySamples given = samples_in_4d();
  energy::Samples samples;
  for (std::size_t i = 0; i < kSamples; ++i) {
    const Quaternion& q = given.points[i];
    samples.add({q.x, q.y, q.z}, given.weights[i], given.targets[i], given.sides[i],
                q.w - map.dynamics.slice);
  }
  const Energy energy(test::shared_device(), map, given,
                      with_loss(EnergyLoss::distance, iterations));
  const auto reference = energy::make_reference_evaluator(
      samples, {energy::Loss::distance, iterations, 1, kUsualEscape});
  const auto expected = reference->evaluate(map, true);
  CHECK(energy.size() == 56);
  CHECK(energy.unknowns() == energy::to_unknowns(map));
  CHECK(energy.value(energy.unknowns()) == Catch::Approx(expected.energy).epsilon(1e-10));
  std::vector<double> gradient(energy.size());
  CHECK(energy.value_and_gradient(energy.unknowns(), gradient) ==
        Catch::Approx(expected.energy).epsilon(1e-10));
  for (std::size_t i = 0; i < gradient.size(); ++i) {
    CHECK(gradient[i] == Catch::Approx(expected.gradient[i]).epsilon(1e-8).margin(1e-12));
  }
  // At other unknowns than the map's own.
  auto x = energy.unknowns();
  x[0] += 0.1;
  x[3] *= 1.2;
  x.back() -= 0.05;
  const Map moved = energy.map_at(x);
  CHECK(moved.dynamics.log_scale == x[0]);
  CHECK(moved.dynamics.factors[2].exponent == x[3]);
  CHECK(moved.dynamics.factors.back().center.w == x.back());
  const auto field = energy.field_at(x);
  const auto right = reference->field(moved);
  const auto asked =
      Field(test::shared_device(), moved, Precision::dbl).at(given.points, iterations);
  for (std::size_t i = 0; i < kSamples; ++i) {
    CHECK(field[i] == Catch::Approx(right[i]).epsilon(1e-9));
    CHECK(field[i] == Catch::Approx(asked[i]).epsilon(1e-9));
  }
}

TEST_CASE("a user-defined loss equal to the library's gives the same energy and gradient") {
  const auto precision = GENERATE(Precision::single, Precision::dbl);
  if (!test::can_check(test::shared_device(), precision)) return;
  const int iterations = GENERATE(1, 3);
  const EnergySamples samples = samples_in_4d();
  EnergyOptions options = with_loss(EnergyLoss::own, iterations, precision);
  options.own = [&](double field, std::size_t i) -> std::pair<double, double> {
    const double residual = field - samples.targets[i];
    if (samples.sides[i] * residual > 0) return {0, 0};
    return {0.5 * residual * residual, residual};
  };
  const Energy own(test::shared_device(), map_to_fit(), samples, options);
  const Energy built_in(test::shared_device(), map_to_fit(), samples,
                        with_loss(EnergyLoss::distance, iterations, precision));
  const auto x = own.unknowns();
  const double tolerance = precision == Precision::dbl ? 1e-10 : 1e-5;
  CHECK(own.value(x) == Catch::Approx(built_in.value(x)).epsilon(tolerance));
  const auto found = energy_gradient(own, x), expected = energy_gradient(built_in, x);
  for (std::size_t i = 0; i < x.size(); ++i) {
    CHECK(found[i] == Catch::Approx(expected[i]).epsilon(100 * tolerance).margin(10 * tolerance));
  }
}

TEST_CASE("what samples leave out has the values the header says, and layers are left aside") {
  if (!test::can_check(test::shared_device(), Precision::dbl)) return;
  Map map = map_to_fit();
  map.dynamics.surface_level = 0.15;
  EnergySamples given = samples_in_4d();
  given.targets.clear();
  given.sides.clear();
  given.weights.clear();
  EnergySamples whole = given;
  whole.targets.assign(kSamples, 0.15);
  whole.sides.assign(kSamples, 0);
  whole.weights.assign(kSamples, 1.0 / kSamples);
  const auto options = with_loss(EnergyLoss::distance, 2);
  const Energy energy(test::shared_device(), map, given, options);
  const auto x = energy.unknowns();
  const double value = energy.value(x);
  CHECK(value > 0);
  CHECK(Energy(test::shared_device(), map, whole, options).value(x) == value);
  map.layers.steepness = 3;
  map.layers.portals = {{{0.9, 0.2, 0.1}, 0.5, 2.5, {}, {0.1, 0, 0}, PortalMask::none}};
  const Energy layered(test::shared_device(), map, given, options);
  CHECK(layered.value(x) == value);
  CHECK(layered.map_at(x).layers.steepness == 3);
  CHECK(layered.map_at(x).layers.portals.size() == 1);
}

TEST_CASE("a few steps down the gradient lower the energy") {
  const Energy energy(test::shared_device(), map_to_fit(), samples_in_4d());
  auto x = energy.unknowns();
  std::vector<double> gradient(energy.size());
  const double before = energy.value(x);
  for (int step = 0; step < 40; ++step) {
    energy.value_and_gradient(x, gradient);
    for (std::size_t i = 0; i < x.size(); ++i) x[i] -= 0.02 * gradient[i];
  }
  CHECK(energy.value(x) < 0.9 * before);
}

TEST_CASE("bad samples, options and unknowns of an energy are refused by name") {
  const Device& device = test::shared_device();
  const Map map = map_to_fit();
  const EnergySamples good = samples_in_4d();
  const auto with = [&](const auto& change) {
    return [&] {
      EnergySamples samples = good;
      EnergyOptions options;
      change(samples, options);
      Energy(device, map, samples, options);
    };
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  refuses_by_name("points", with([](auto& s, auto&) { s = {}; }));
  refuses_by_name("targets", with([](auto& s, auto&) { s.targets.pop_back(); }));
  refuses_by_name("targets", with([](auto& s, auto&) { s.targets[4] = kNan; }));
  refuses_by_name("sides", with([](auto& s, auto&) { s.sides.push_back(1); }));
  refuses_by_name("sides", with([](auto& s, auto&) { s.sides[2] = 0.5; }));
  refuses_by_name("sides", with([](auto& s, auto& o) {
                    s.sides[2] = 0;
                    o.loss = EnergyLoss::tanh;
                  }));
  refuses_by_name("sides", with([](auto& s, auto& o) {
                    s.sides.clear();
                    o.loss = EnergyLoss::tanh;
                  }));
  refuses_by_name("weights", with([](auto& s, auto&) { s.weights.resize(3); }));
  refuses_by_name("weights", with([](auto& s, auto&) { s.weights[5] = -1; }));
  refuses_by_name("weights", with([](auto& s, auto&) {
                    s.weights[5] = std::numeric_limits<double>::infinity();
                  }));
  refuses_by_name("iterations", with([](auto&, auto& o) { o.iterations = 0; }));
  refuses_by_name("iterations", with([](auto&, auto& o) { o.iterations = 17; }));
  refuses_by_name("alpha", with([](auto&, auto& o) { o.alpha = 0; }));
  refuses_by_name("escape", with([](auto&, auto& o) { o.escape = -1; }));
  refuses_by_name("escape", with([](auto&, auto& o) { o.escape = 1e10; }));
  refuses_by_name("own", with([](auto&, auto& o) { o.loss = EnergyLoss::own; }));
  refuses_by_name("own", with([](auto&, auto& o) { o.own = quartic; }));
  CHECK_THROWS_WITH(with([](auto& s, auto&) { s.points[7].w = kNan; })(),
                    Catch::Matchers::ContainsSubstring("point 7 is not finite"));
  CHECK_THROWS_AS(Energy(device, quadratic_map({}), good), InputError);
  CHECK_THROWS_AS(Energy(device, Map{}, good), InputError);

  const Energy energy(device, map, good);
  auto x = energy.unknowns();
  std::vector<double> gradient(energy.size() - 1);
  refuses_by_name("gradient", [&] { energy.value_and_gradient(x, gradient); });
  x.pop_back();
  refuses_by_name("x", [&] { energy.value(x); });
  refuses_by_name("x", [&] { energy.field_at(x); });
  refuses_by_name("x", [&] { energy.map_at(x); });
  x.push_back(kNan);
  refuses_by_name("x", [&] { energy.value(x); });
  x.back() = 1e12;
  CHECK_THROWS_AS(energy.map_at(x), InputError);
  EnergyOptions with_slice;
  with_slice.slice = true;
  refuses_by_name("x", [&] { Energy(device, map, good, with_slice).value(energy.unknowns()); });
}
