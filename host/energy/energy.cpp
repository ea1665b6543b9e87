#include "qjulia/energy/energy.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <string>

#include "base/range_check.hpp"
#include "energy/evaluator.hpp"
#include "map/checks.hpp"

namespace qjulia {

using namespace energy;

namespace {

/// @throws OptionError unless there are none or as many as points, all of them finite.
void check_numbers(const char* field, const std::vector<double>& values, std::size_t points) {
  if (!values.empty() && values.size() != points) {
    throw OptionError(field, fmt::format("there are {} for {} points; give one for each, or none",
                                         values.size(), points));
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isfinite(values[i])) continue;
    throw OptionError(field, fmt::format("number {} is {}; give finite numbers (they count from 0)",
                                         i, values[i]));
  }
}

void check_length(const char* name, std::size_t given, std::size_t wanted, bool with_slice) {
  if (given == wanted) return;
  throw OptionError(name, fmt::format("has {} numbers; give {}, as the map has unknowns: S, then "
                                      "exponents, centres' X, Y, Z, W{}",
                                      given, wanted, with_slice ? ", then the slice" : ""));
}

void check_sides(const EnergySamples& samples, EnergyLoss loss) {
  if (loss != EnergyLoss::tanh) return;
  const bool all = !samples.sides.empty() &&
                   std::ranges::none_of(samples.sides, [](double side) { return side == 0; });
  if (all) return;
  throw OptionError("sides",
                    "with the loss tanh every sample needs a side; give 1 outside and −1 "
                    "inside, or choose another loss");
}

Loss internal(EnergyLoss loss) { return loss == EnergyLoss::tanh ? Loss::tanh : Loss::distance; }

EnergySettings settings_of(const EnergyOptions& options) {
  return {internal(options.loss), options.iterations, options.alpha, options.escape};
}

Samples to_samples(const EnergySamples& given, const Map& map) {
  Samples samples;
  const double share = 1 / static_cast<double>(given.size());
  for (std::size_t i = 0; i < given.size(); ++i) {
    const auto [x, y, z, w] = given.points[i];
    samples.add({x, y, z}, given.weights.empty() ? share : given.weights[i],
                given.targets.empty() ? map.dynamics.surface_level : given.targets[i],
                given.sides.empty() ? 0 : given.sides[i], w - map.dynamics.slice);
  }
  return samples;
}

}  // namespace

void EnergyOptions::validate() const {
  base::expect_between("iterations", iterations, 1, kMostIterations);
  base::expect_positive("alpha", alpha);
  base::expect_positive("escape", escape);
  if (escape > kLargestEscape) {
    throw OptionError("escape", fmt::format("{} is too large; give {} or less, map units", escape,
                                            kLargestEscape));
  }
  if ((loss == EnergyLoss::own) != static_cast<bool>(own)) {
    throw OptionError("own", own ? "is given, but the loss is another; set the loss to own"
                                 : "is empty; give a loss, or set another than own");
  }
}

void EnergySamples::validate() const {
  if (points.empty()) throw OptionError("points", "there are none; give at least one");
  map::check_points(points);
  check_numbers("targets", targets, size());
  check_numbers("sides", sides, size());
  check_numbers("weights", weights, size());
  for (std::size_t i = 0; i < sides.size(); ++i) {
    if (sides[i] == 0 || std::abs(sides[i]) == 1) continue;
    throw OptionError("sides", fmt::format("number {} is {}; give −1, 0 or 1", i, sides[i]));
  }
  for (std::size_t i = 0; i < weights.size(); ++i) {
    if (weights[i] >= 0) continue;
    throw OptionError("weights", fmt::format("number {} is {}; give 0 or more", i, weights[i]));
  }
}

struct Energy::Impl {
  Device device;
  Map map;
  Map bare;  ///< its dynamics alone, which are evaluated
  Samples samples;
  EnergyOptions options;
  std::unique_ptr<Evaluator> evaluator;

  std::size_t size_of_factors() const { return 1 + 5 * map.dynamics.factors.size(); }
  std::size_t size() const { return size_of_factors() + (options.slice ? 1 : 0); }

  void check_size(const char* name, std::size_t given) const {
    check_length(name, given, size(), options.slice);
  }

  Map bare_at(std::span<const double> x) const {
    check_size("x", x.size());
    const auto wrong = std::ranges::find_if(x, [](double v) { return !std::isfinite(v); });
    if (wrong != x.end()) {
      throw OptionError("x", fmt::format("number {} is {}; give finite numbers (they count from 0)",
                                         wrong - x.begin(), *wrong));
    }
    Map at = with_unknowns(bare, x.first(size_of_factors()));
    if (options.slice) at.dynamics.slice = x.back();
    return at;
  }

  /// The energy and, where there is room for it, the gradient.
  double evaluate(const Map& at, std::span<double> gradient) const {
    if (options.own) return evaluate_own(at, gradient);
    const Evaluation found = evaluator->evaluate(at, !gradient.empty());
    if (gradient.empty()) return found.energy;
    std::ranges::copy(found.gradient, gradient.begin());
    if (options.slice) {
      std::vector<double> slopes = evaluator->field(at);
      for (std::size_t i = 0; i < slopes.size(); ++i) {
        slopes[i] = loss_term(samples, i, slopes[i], settings_of(options)).slope;
      }
      gradient.back() = slope_by_slice(at, slopes);
    }
    return found.energy;
  }

  /// The same for a loss that the caller defines.
  double evaluate_own(const Map& at, std::span<double> gradient) const {
    std::vector<double> slopes = evaluator->field(at);
    Samples linear_samples = samples;
    double energy = 0;
    for (std::size_t i = 0; i < slopes.size(); ++i) {
      const auto [value, slope] = options.own(slopes[i], i);
      energy += samples.weight[i] * value;
      linear_samples.target[i] = slope;
      slopes[i] = samples.weight[i] * slope;
    }
    if (gradient.empty()) return energy;
    EnergySettings linear = settings_of(options);
    linear.loss = Loss::linear;
    const Evaluation found =
        make_device_evaluator(device, linear_samples, linear, options.precision)
            ->evaluate(at, true);
    std::ranges::copy(found.gradient, gradient.begin());
    if (options.slice) gradient.back() = slope_by_slice(at, slopes);
    return energy;
  }

  /// ∂E by the slice: the sum over samples of ∂F_n/∂W times ∂E/∂F_n. NaN where the map is beyond
  /// what a field takes.
  double slope_by_slice(const Map& at, const std::vector<double>& slopes) const {
    std::vector<Quaternion> points;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const Eigen::Vector3d& x = samples.position[i];
      points.push_back({x.x(), x.y(), x.z(), at.dynamics.slice + samples.off_slice[i]});
    }
    try {
      const Field field(device, at, options.precision, {.escape = options.escape});
      const auto gradients = field.gradient_at(points, options.iterations);
      return std::transform_reduce(
          slopes.begin(), slopes.end(), gradients.begin(), 0.0, std::plus<>(),
          [](double slope, const Quaternion& by_point) { return slope * by_point.w; });
    } catch (const InputError&) {
      return std::numeric_limits<double>::quiet_NaN();
    }
  }
};

Energy::Energy(const Device& device, const Map& map, const EnergySamples& samples,
               const EnergyOptions& options) {
  options.validate();
  samples.validate();
  check_sides(samples, options.loss);
  map.validate();
  if (!map.dynamics.is_rational()) {
    throw InputError(fmt::format("the map is {}, and has no unknowns to fit; give a rational one",
                                 map.dynamics.kind()));
  }
  Map bare;
  bare.dynamics = map.dynamics;
  Samples all = to_samples(samples, map);
  auto evaluator = make_device_evaluator(device, all, settings_of(options), options.precision);
  impl_ = std::make_unique<Impl>(
      Impl{device, map, std::move(bare), std::move(all), options, std::move(evaluator)});
}

Energy::~Energy() = default;
Energy::Energy(Energy&&) noexcept = default;
Energy& Energy::operator=(Energy&&) noexcept = default;

std::size_t Energy::size() const { return impl_->size(); }

std::vector<double> Energy::unknowns() const {
  std::vector<double> x = to_unknowns(impl_->map);
  if (impl_->options.slice) x.push_back(impl_->map.dynamics.slice);
  return x;
}

double Energy::value(std::span<const double> x) const {
  return impl_->evaluate(impl_->bare_at(x), {});
}

double Energy::value_and_gradient(std::span<const double> x, std::span<double> gradient) const {
  const Map at = impl_->bare_at(x);
  impl_->check_size("gradient", gradient.size());
  return impl_->evaluate(at, gradient);
}

std::vector<double> Energy::field_at(std::span<const double> x) const {
  return impl_->evaluator->field(impl_->bare_at(x));
}

Map Energy::map_at(std::span<const double> x) const {
  Map map = impl_->map;
  map.dynamics = impl_->bare_at(x).dynamics;
  map.validate();
  return map;
}

}  // namespace qjulia
