#include <array>
#include <numeric>

#include "base/larger_error.hpp"
#include "check/checks.hpp"
#include "check/small_problems.hpp"
#include "device/context.hpp"
#include "energy/device_factor.hpp"
#include "energy/evaluator.hpp"
#include "profile/workload.hpp"

namespace qjulia::check {
namespace {

using base::larger_error;
using profiling::kNoEscape;
using profiling::largest_difference;
using profiling::Workload;

std::vector<double> fields(energy::Evaluator& evaluator, const Map& map) {
  return evaluator.field(map);
}

std::vector<double> gradient(energy::Evaluator& evaluator, const Map& map) {
  return evaluator.evaluate(map, true).gradient;
}

std::vector<double> gauss_newton(energy::Evaluator& evaluator, const Map& map) {
  const Eigen::MatrixXd h = evaluator.gauss_newton(map);
  return {h.data(), h.data() + h.size()};
}

/// What both evaluators make of the work, compared.
template <auto kCompute, int kOrbit>
double evaluated(const Device& device, Precision precision) {
  const Workload work = small_work();
  const energy::EnergySettings options{energy::Loss::distance, kOrbit, 1, kNoEscape};
  const auto found = energy::make_device_evaluator(device, work.samples, options, precision);
  const auto right = energy::make_reference_evaluator(work.samples, options);
  return largest_difference(kCompute(*found, work.map), kCompute(*right, work.map));
}

constexpr Eigen::Index kOrder = 500;
constexpr double kDamping = 0.01;

/// Symmetric and positive definite: entry (i, j) is 1 / (1 + (i − j)²).
Eigen::MatrixXf falling_matrix() {
  return Eigen::MatrixXf::NullaryExpr(kOrder, kOrder, [](Eigen::Index i, Eigen::Index j) {
    const auto apart = static_cast<float>(i - j);
    return 1 / (1 + apart * apart);
  });
}

/// Uploads that matrix and returns `make` of it.
template <class Make>
auto of_falling_matrix(const Device& device, const Make& make) {
  const Eigen::MatrixXf h = falling_matrix();
  std::vector<std::int32_t> place(kOrder);
  std::iota(place.begin(), place.end(), 0);
  const auto rows = device.context().upload_real({h.data(), static_cast<std::size_t>(h.size())});
  return make(energy::DeviceMatrix{rows, kOrder, place, Eigen::VectorXd::Ones(kOrder)});
}

/// L of the matrix, with the host's.
double cholesky(const Device& device, Precision /*precision*/) {
  const auto found = of_falling_matrix(device, [&](const energy::DeviceMatrix& h) {
    return energy::factorised(device, h, kDamping);
  });
  if (!found) return kInfinite;
  const Eigen::MatrixXf difference =
      found->lower.topLeftCorner(kOrder, kOrder) -
      energy::factorised(falling_matrix().cast<double>(), kDamping).lower;
  double worst = 0;
  for (Eigen::Index j = 0; j < kOrder; ++j) {
    for (Eigen::Index i = j; i < kOrder; ++i)
      worst = larger_error(worst, std::abs(difference(i, j)));
  }
  return worst;
}

/// Largest difference between products with R⁻¹ on the device, in the layout of GPUs whatever the
/// device's own, and the host's solutions. The factor needs double precision; R⁻¹ is in single.
double inverse(const Device& device, Precision /*precision*/) {
  const Device cut_finely = device.with_layout(Layout::gpu);
  const auto found = of_falling_matrix(device, [&](const energy::DeviceMatrix& h) {
    return energy::make_preconditioner(cut_finely, h, kDamping);
  });
  if (!found) return kInfinite;
  const auto right =
      energy::preconditioner_of(energy::factorised(falling_matrix().cast<double>(), kDamping));
  const Eigen::VectorXd vector = Eigen::VectorXd::LinSpaced(kOrder, -1, 2);
  const auto numbers = [](const Eigen::VectorXd& v) {
    return std::vector<double>(v.begin(), v.end());
  };
  return larger_error(
      largest_difference(numbers(found->move(vector)), numbers(right->move(vector))),
      largest_difference(numbers(found->gradient(vector)), numbers(right->gradient(vector))));
}

constexpr std::array kEnergyChecks{
    Check{"energy.cl", "F_4 at samples, with the reference", 1e-4, 1e-10,
          evaluated<fields, kIterations>, true},
    Check{"gradient_potential.cl", "gradient at n = 1, with the reference", 1e-4, 1e-10,
          evaluated<gradient, 1>},
    Check{"gradient_orbit.cl", "gradient at n = 4, with the reference", 1e-4, 1e-10,
          evaluated<gradient, kIterations>, true},
    Check{"gauss_newton.cl", "Gauss-Newton matrix, with the reference", 1e-4, 1e-10,
          evaluated<gauss_newton, 1>, true},
    Check{"cholesky.cl", "a factorised matrix, with the host's", kNotBuilt, 1e-5, cholesky},
    Check{"triangle.cl", "products with the inverse of a factor, with the host's solutions",
          kNotBuilt, 1e-5, inverse},
};

}  // namespace

std::span<const Check> energy_checks() { return kEnergyChecks; }

}  // namespace qjulia::check
