#include "fit/sample_weights.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "qjulia/base/error.hpp"

namespace qjulia::fitting {

std::vector<double> weights_at(const SampleWeights& weights,
                               std::span<const Eigen::Vector3d> points) {
  std::vector<double> found = weights(points);
  if (found.size() != points.size()) {
    throw OptionError("weights", fmt::format("there are {} for {} points; give one for each",
                                             found.size(), points.size()));
  }
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i] >= 0 && std::isfinite(found[i])) continue;
    const Eigen::Vector3d& x = points[i];
    throw OptionError(
        "weights", fmt::format("the one at ({:.6g}, {:.6g}, {:.6g}) is {}; give 0 or more", x.x(),
                               x.y(), x.z(), found[i]));
  }
  return found;
}

void weigh(Samples& samples, const SampleWeights& weights, const ShapeToMap& frame, Loss loss) {
  std::vector<std::size_t> numbers;
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples.off_slice[i] != 0) continue;
    numbers.push_back(i);
    points.push_back(frame.to_shape(samples.position[i]));
  }
  const std::vector<double> factors = weights_at(weights, points);
  const auto group = [&](std::size_t i) {
    return static_cast<std::size_t>(loss == Loss::tanh && samples.side[i] < 0);
  };
  std::array<double, 2> before{}, after{};
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    double& weight = samples.weight[numbers[i]];
    before[group(numbers[i])] += weight;
    weight *= factors[i];
    after[group(numbers[i])] += weight;
  }
  for (std::size_t g = 0; g < before.size(); ++g) {
    if (before[g] == 0 || (after[g] > 0 && std::isfinite(after[g]))) continue;
    const char* which = loss != Loss::tanh ? "" : g == 0 ? " outside" : " inside";
    throw OptionError("weights", fmt::format("those of all samples{} sum to {}; give numbers whose "
                                             "sum is above 0 and finite",
                                             which, after[g]));
  }
  for (const std::size_t i : numbers) {
    const std::size_t g = group(i);
    if (before[g] > 0) samples.weight[i] *= before[g] / after[g];  // else all of them are 0
  }
}

}  // namespace qjulia::fitting
