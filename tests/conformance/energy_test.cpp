// Energy and gradient kernels: against central differences of their own energy in double, at every
// lane width and number of iterations.

#include <catch2/catch.hpp>
#include <cmath>

#include "fit/evaluator.hpp"
#include "random_maps.hpp"

using namespace qjulia;

namespace {

/// Largest difference between the gradient and central differences, over the largest component.
double gradient_error(Evaluator& evaluator, const RationalMap& map, double step) {
  const auto gradient = evaluator.evaluate(map, true).gradient;
  const auto at = to_unknowns(map);
  double worst = 0;
  double largest = 0;
  for (std::size_t i = 0; i < at.size(); ++i) {
    auto up = at;
    auto down = at;
    up[i] += step;
    down[i] -= step;
    const double difference = (evaluator.evaluate(with_unknowns(map, up), false).energy -
                               evaluator.evaluate(with_unknowns(map, down), false).energy) /
                              (2 * step);
    worst = std::max(worst, std::abs(difference - gradient[i]));
    largest = std::max(largest, std::abs(difference));
  }
  return worst / largest;
}

}  // namespace

TEST_CASE("gradients agree with central differences in double") {
  const int width = GENERATE(1, 8, 16);
  const int iterations = GENERATE(1, 2, 3, 4);
  const auto loss = GENERATE(Loss::tanh, Loss::distance);
  const auto device = Device::choose("cpu").with_lane_width(width);
  const auto map = test::random_map(14, 0.1, 0.6, 7);
  const auto samples = test::random_samples(333, 8);
  EnergyOptions options{loss, iterations, 1.0, 20};
  const auto evaluator = make_device_evaluator(device, samples, options, Precision::dbl);
  INFO("width " << width << " n " << iterations);
  CHECK(gradient_error(*evaluator, map, 1e-6) < 1e-6);
}

TEST_CASE("single precision gradients agree with double") {
  const int width = GENERATE(1, 8, 16);
  const int iterations = GENERATE(1, 2, 3, 4);
  const auto device = Device::choose("cpu").with_lane_width(width);
  const auto map = test::random_map(64, 0.01, 0.06, 9);
  const auto samples = test::random_samples(1000, 10);
  EnergyOptions options{Loss::tanh, iterations, 1.0, 20};
  const auto one =
      make_device_evaluator(device, samples, options, Precision::single)->evaluate(map, true);
  const auto two =
      make_device_evaluator(device, samples, options, Precision::dbl)->evaluate(map, true);
  double worst = 0;
  double largest = 0;
  for (std::size_t i = 0; i < one.gradient.size(); ++i) {
    worst = std::max(worst, std::abs(one.gradient[i] - two.gradient[i]));
    largest = std::max(largest, std::abs(two.gradient[i]));
  }
  INFO("width " << width << " n " << iterations);
  CHECK(worst / largest < 2e-5);
  CHECK(std::abs(one.energy - two.energy) < 1e-5);
}

TEST_CASE("the Gauss-Newton matrix is the product of gradients of F") {
  const int width = GENERATE(1, 8, 16);
  const auto device = Device::choose("cpu").with_lane_width(width);
  const auto map = test::random_map(21, 0.1, 0.6, 3);
  auto samples = test::random_samples(40, 4);
  const EnergyOptions options{Loss::distance, 1, 1.0, 20};
  const auto field = make_device_evaluator(device, samples, options, Precision::dbl)->field(map);
  const auto order = static_cast<Eigen::Index>(to_unknowns(map).size());
  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(order, order);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples.side[i] * (field[i] - samples.target[i]) > 0) continue;
    // With one two-sided sample of weight 1 and target F - 1 the energy's gradient is that of F.
    Samples one;
    one.add(samples.position[i], 1, field[i] - 1, 0);
    const auto g =
        make_device_evaluator(device, one, options, Precision::dbl)->evaluate(map, true).gradient;
    const Eigen::Map<const Eigen::VectorXd> row(g.data(), order);
    expected += samples.weight[i] * row * row.transpose();
  }
  const auto scale = expected.cwiseAbs().maxCoeff();
  for (const auto precision : {Precision::dbl, Precision::single}) {
    const auto h = make_device_evaluator(device, samples, options, precision)->gauss_newton(map);
    INFO("width " << width);
    CHECK((h - expected).cwiseAbs().maxCoeff() / scale <
          (precision == Precision::dbl ? 1e-10 : 1e-5));
  }
}
