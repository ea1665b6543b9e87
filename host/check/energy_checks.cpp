#include <array>

#include "check/checks.hpp"
#include "check/small_problems.hpp"
#include "energy/evaluator.hpp"
#include "profile/workload.hpp"

namespace qjulia::check {
namespace {

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

/// The entries of the coarse matrix over blocks of at most 16 factors, then those of the blocks.
std::vector<double> blocks(energy::Evaluator& evaluator, const Map& map) {
  const auto found = evaluator.gauss_newton_blocks(map, energy::neighbour_blocks(map, 16));
  std::vector<double> entries(found.coarse.data(), found.coarse.data() + found.coarse.size());
  for (const Eigen::MatrixXd& own : found.own) {
    entries.insert(entries.end(), own.data(), own.data() + own.size());
  }
  return entries;
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

constexpr std::array kEnergyChecks{
    Check{"energy.cl", "F_4 at samples, with the reference", 1e-4, 1e-10,
          evaluated<fields, kIterations>, true},
    Check{"gradient_potential.cl", "gradient at n = 1, with the reference", 1e-4, 1e-10,
          evaluated<gradient, 1>},
    Check{"gradient_orbit.cl", "gradient at n = 4, with the reference", 1e-4, 1e-10,
          evaluated<gradient, kIterations>, true},
    Check{"gauss_newton.cl", "Gauss-Newton matrix, with the reference", 1e-4, 1e-10,
          evaluated<gauss_newton, 1>, true},
    Check{"gauss_newton.cl", "blocks of that matrix, with the reference", 1e-4, 1e-10,
          evaluated<blocks, 1>},
};

}  // namespace

std::span<const Check> energy_checks() { return kEnergyChecks; }

}  // namespace qjulia::check
