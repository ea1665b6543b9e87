#include "qjulia/energy.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "base/range_check.hpp"
#include "fit/evaluator.hpp"
#include "map/checks.hpp"

namespace qjulia {

using namespace fitting;

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

void check_length(const char* name, std::size_t given, std::size_t wanted) {
  if (given == wanted) return;
  throw OptionError(name, fmt::format("has {} numbers; give {}, as the map has unknowns: S, then "
                                      "exponents, centres' X, Y, Z, W",
                                      given, wanted));
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

  std::size_t size() const { return 1 + 5 * map.dynamics.factors.size(); }

  Map bare_at(std::span<const double> x) const {
    check_length("x", x.size(), size());
    const auto wrong = std::ranges::find_if(x, [](double v) { return !std::isfinite(v); });
    if (wrong != x.end()) {
      throw OptionError("x", fmt::format("number {} is {}; give finite numbers (they count from 0)",
                                         wrong - x.begin(), *wrong));
    }
    return with_unknowns(bare, x);
  }

  /// The energy of a loss of one's own, and the gradient where there is room for it.
  double evaluate_own(const Map& at, std::span<double> gradient) const {
    const std::vector<double> field = evaluator->field(at);
    Samples slopes = samples;
    double energy = 0;
    for (std::size_t i = 0; i < field.size(); ++i) {
      const auto [value, slope] = options.own(field[i], i);
      energy += samples.weight[i] * value;
      slopes.target[i] = slope;
    }
    if (gradient.empty()) return energy;
    EnergySettings linear = settings_of(options);
    linear.loss = Loss::linear;
    const Evaluation found =
        make_device_evaluator(device, slopes, linear, options.precision)->evaluate(at, true);
    std::ranges::copy(found.gradient, gradient.begin());
    return energy;
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

std::vector<double> Energy::unknowns() const { return to_unknowns(impl_->map); }

double Energy::value(std::span<const double> x) const {
  const Map at = impl_->bare_at(x);
  if (impl_->options.own) return impl_->evaluate_own(at, {});
  return impl_->evaluator->evaluate(at, false).energy;
}

double Energy::value_and_gradient(std::span<const double> x, std::span<double> gradient) const {
  const Map at = impl_->bare_at(x);
  check_length("gradient", gradient.size(), size());
  if (impl_->options.own) return impl_->evaluate_own(at, gradient);
  const Evaluation found = impl_->evaluator->evaluate(at, true);
  std::ranges::copy(found.gradient, gradient.begin());
  return found.energy;
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
