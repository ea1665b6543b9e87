// The gradient kernels against central differences of the energy kernel, in double, at every lane
// width and number of iterations; evaluator tests hold both to the reference.

#include <catch2/catch_all.hpp>
#include <cmath>

#include "base/larger_error.hpp"
#include "energy/evaluator.hpp"
#include "random_maps.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

/// Largest difference between the gradient and central differences, over the largest component.
double gradient_error(energy::Evaluator& evaluator, const Map& map, double step) {
  const auto gradient = evaluator.evaluate(map, true).gradient;
  const auto at = energy::to_unknowns(map);
  double worst = 0;
  double largest = 0;
  for (std::size_t i = 0; i < at.size(); ++i) {
    auto up = at;
    auto down = at;
    up[i] += step;
    down[i] -= step;
    const double difference = (evaluator.evaluate(energy::with_unknowns(map, up), false).energy -
                               evaluator.evaluate(energy::with_unknowns(map, down), false).energy) /
                              (2 * step);
    worst = base::larger_error(worst, std::abs(difference - gradient[i]));
    largest = std::max(largest, std::abs(difference));
  }
  return worst / largest;
}

/// Samples with some in hard places: 1e-3 from a factor's centre, and 1e-3 from the half-line
/// behind a centre on the slice, where the angle nears pi and the versor has its branch cut.
energy::Samples hard_samples(const Map& map, std::size_t count, std::uint64_t seed) {
  energy::Samples samples = test::random_samples(count, seed);
  for (std::size_t i = 0; i < 8; ++i) {
    const Quaternion& c = map.dynamics.factors[i].center;
    samples.position[2 * i] = {c.x + 6e-4, c.y - 6e-4, c.z + 5e-4};
    samples.position[2 * i + 1] = {c.x - 0.3, c.y + 8e-4, c.z - 6e-4};
  }
  return samples;
}

/// A random map, half of whose centres lie on the slice.
Map map_on_slice(std::size_t factors, std::uint64_t seed) {
  Map map = test::random_map(factors, 0.1, 0.6, seed);
  for (std::size_t k = 0; k < factors; k += 2) map.dynamics.factors[k].center.w = 0;
  return map;
}

}  // namespace

TEST_CASE("gradients agree with central differences in double") {
  const test::Variant variant = GENERATE(from_range(test::variants()));
  const int iterations = GENERATE(1, 2, 3, 4);
  const auto loss = GENERATE(energy::Loss::tanh, energy::Loss::distance);
  const auto device = variant.of(test::shared_device());
  if (!test::can_check(device, Precision::dbl)) return;
  const auto map = map_on_slice(14, 7);
  const auto samples = hard_samples(map, 61, 8);
  const energy::EnergySettings options{loss, iterations, 1.0, 20};
  const auto evaluator = energy::make_device_evaluator(device, samples, options, Precision::dbl);
  INFO("variant " << variant << " n " << iterations);
  CHECK(gradient_error(*evaluator, map, 2e-7) < 1e-6);
}
