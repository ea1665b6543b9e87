// The reference iteration and evaluator: against the original program, against quaternion powers,
// and its derivatives against central differences.

#include <catch2/catch_all.hpp>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/larger_error.hpp"
#include "energy/evaluator.hpp"
#include "map/reference_iteration.hpp"
#include "original.hpp"
#include "random_maps.hpp"

using namespace qjulia;

namespace {

/// What the original program computed, in this program's terms.
class Original : public test::OriginalFigures {
 public:
  energy::Samples samples() const {
    const auto x = numbers("cellCentreX");
    const auto y = numbers("cellCentreY");
    const auto z = numbers("cellCentreZ");
    const auto weights = numbers("weights");
    energy::Samples samples;
    for (const double zc : z) {
      for (const double yc : y) {
        for (const double xc : x) {
          const double signed_weight = weights[samples.size()];
          samples.add({xc, yc, zc}, std::abs(signed_weight), 0, signed_weight < 0 ? -1 : 1);
        }
      }
    }
    return samples;
  }

  std::unique_ptr<energy::Evaluator> evaluator(int iterations) const {
    return energy::make_reference_evaluator(
        samples(), {energy::Loss::tanh, iterations, number("tanhAlpha"), number("escape")});
  }

  /// A gradient by our unknowns in the original's order: ln scale, bottom powers, top powers, and
  /// the scalars over all top and all bottom powers (by the chain rule).
  std::vector<double> in_original_order(const std::vector<double>& gradient) const {
    const auto top = numbers("topPowers");
    const auto bottom = numbers("bottomPowers");
    const std::size_t factors = top.size() + bottom.size();
    std::vector<double> result{gradient[0]};
    double top_scalar = 0;
    double bottom_scalar = 0;
    for (std::size_t k = 0; k < bottom.size(); ++k) {
      const double by_exponent = gradient[1 + factors - 1 - k];
      result.push_back(-number("bottomPowerScalar") * by_exponent);
      bottom_scalar -= bottom[k] * by_exponent;
    }
    for (std::size_t k = 0; k < top.size(); ++k) {
      result.push_back(number("topPowerScalar") * gradient[1 + k]);
      top_scalar += top[k] * gradient[1 + k];
    }
    result.push_back(top_scalar);
    result.push_back(bottom_scalar);
    return result;
  }
};

double largest(const std::vector<double>& values) {
  double size = 0;
  for (const double v : values) size = std::max(size, std::abs(v));
  return size;
}

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  REQUIRE(a.size() == b.size());
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    worst = base::larger_error(worst, std::abs(a[i] - b[i]));
  return worst;
}

}  // namespace

TEST_CASE("the reference reproduces the original's field for 1, 2 and 3 iterations") {
  const Original original;
  for (const int n : {1, 2, 3}) {
    const auto expected = original.numbers("logField_n" + std::to_string(n));
    const auto field = original.evaluator(n)->field(original.map());
    double worst = 0;
    for (std::size_t i = 0; i < field.size(); ++i) {
      worst = base::larger_error(
          worst, std::abs(field[i] - expected[i]) / std::max(1.0, std::abs(expected[i])));
    }
    INFO("n " << n << ", " << field.size() << " points");
    CHECK(field.size() == expected.size());
    CHECK(worst < 1e-12);
  }
}

TEST_CASE("the reference reproduces the original's energy") {
  const Original original;
  for (const int n : {1, 2, 3}) {
    const double expected = original.number("energy_n" + std::to_string(n));
    INFO("n " << n);
    CHECK(original.evaluator(n)->evaluate(original.map(), false).energy ==
          Catch::Approx(expected).epsilon(1e-9).margin(0));
  }
}

TEST_CASE("the reference reproduces the original's gradient at n = 1") {
  const Original original;
  const nlohmann::json& g = original.at("gradient_n1");
  std::vector<double> expected{g.at("logExpScaling").get<double>()};
  for (const char* key : {"bottomPowers", "topPowers"}) {
    const auto part = g.at(key).get<std::vector<double>>();
    expected.insert(expected.end(), part.begin(), part.end());
  }
  expected.push_back(g.at("topPowerScalar").get<double>());
  expected.push_back(g.at("bottomPowerScalar").get<double>());
  const auto gradient =
      original.in_original_order(original.evaluator(1)->evaluate(original.map(), true).gradient);
  REQUIRE(gradient.size() == expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    INFO("component " << i);
    CHECK(gradient[i] == Catch::Approx(expected[i]).epsilon(1e-9).margin(0));
  }
}

TEST_CASE("the reference's gradient at n = 2 is the original's central difference") {
  const Original original;
  const auto expected = original.numbers("finiteDifference_n2");
  const auto gradient =
      original.in_original_order(original.evaluator(2)->evaluate(original.map(), true).gradient);
  CHECK(largest_difference(gradient, expected) / largest(expected) < 1e-6);
}

TEST_CASE("an iterate is the product of quaternion powers") {
  auto map = test::random_map(9, 0.1, 0.9, 21);
  map.dynamics.phase = {0.5, -0.5, 0.5, 0.5};
  std::mt19937_64 bits(22);
  for (int i = 0; i < 50; ++i) {
    const Quaternion q{test::uniform(bits, -2, 2), test::uniform(bits, -2, 2),
                       test::uniform(bits, -2, 2), test::uniform(bits, -2, 2)};
    Quaternion expected = std::exp(map.dynamics.log_scale) * map.dynamics.phase;
    for (const auto& [c, a] : map.dynamics.factors) expected = expected * pow(q - c, a);
    const auto [log_norm, versor] = reference::step(map, q);
    CHECK(norm(std::exp(log_norm) * versor - expected) < 1e-12 * norm(expected));
  }
}

TEST_CASE("one factor at the origin with exponent 2 squares, by hand") {
  Map square;
  square.dynamics.factors = {{{0, 0, 0, 0}, 2}};
  const std::vector<Quaternion> starts{{0.5, 0, 0, 0}, {0, 3, 0, 0}, {0, 0, 30, 0}};
  const auto f = reference::field(square, starts, 4, 20);
  CHECK(f[0] == Catch::Approx(16 * std::log(0.5)));  // 2^4 after four
  CHECK(f[1] == Catch::Approx(4 * std::log(3.0)));   // 9 < 20 goes on, 81 is out
  CHECK(f[2] == Catch::Approx(std::log(30.0)));      // starts outside: no iterate runs
}

TEST_CASE("reference gradients are central differences of the energy, all unknowns") {
  const int iterations = GENERATE(1, 2, 3, 4);
  const auto loss = GENERATE(energy::Loss::tanh, energy::Loss::distance);
  auto map = test::random_map(7, 0.1, 0.6, 31);
  map.dynamics.slice = 0.05;
  const auto evaluator =
      energy::make_reference_evaluator(test::random_samples(120, 32), {loss, iterations, 1.0, 20});
  const auto at = energy::to_unknowns(map);
  const auto gradient = evaluator->evaluate(map, true).gradient;
  constexpr double kStep = 1e-6;
  std::vector<double> differences;
  for (std::size_t i = 0; i < at.size(); ++i) {
    auto up = at;
    auto down = at;
    up[i] += kStep;
    down[i] -= kStep;
    differences.push_back((evaluator->evaluate(energy::with_unknowns(map, up), false).energy -
                           evaluator->evaluate(energy::with_unknowns(map, down), false).energy) /
                          (2 * kStep));
  }
  INFO("n " << iterations);
  CHECK(largest_difference(gradient, differences) / largest(differences) < 1e-7);
}

TEST_CASE("derivatives stay finite and right where the vector part vanishes") {
  Map map;
  map.dynamics.factors = {{{0.3, 0, 0, 0}, 0.7}, {{-0.4, 0.2, 0.1, 0}, 0.8}};
  // On the real axis, right of the first centre: sin(a t)/|v| is a limit there.
  const std::vector<Quaternion> starts{{0.9, 0, 0, 0}};
  const auto gradient = reference::field_gradients(map, starts, 3, 20);
  REQUIRE(gradient.allFinite());
  const auto at = energy::to_unknowns(map);
  for (std::size_t i = 0; i < at.size(); ++i) {
    auto up = at;
    auto down = at;
    up[i] += 1e-6;
    down[i] -= 1e-6;
    const double difference =
        (reference::field(energy::with_unknowns(map, up), starts, 3, 20)[0] -
         reference::field(energy::with_unknowns(map, down), starts, 3, 20)[0]) /
        2e-6;
    INFO("unknown " << i);
    CHECK(gradient(0, static_cast<Eigen::Index>(i)) == Catch::Approx(difference).margin(1e-6));
  }
}
