#pragma once
/// The work that settings are tried with, and what must come out of it.

#include <memory>
#include <vector>

#include "fit/evaluator.hpp"
#include "profile/workload.hpp"
#include "qjulia/device.hpp"

namespace qjulia::profiling {

enum class TuneJob { energy, gradient, orbit_energy, orbit_gradient, gauss_newton };

/// What a job computes, as numbers to compare: the energy; the energy, then the gradient; the
/// matrix.
std::vector<double> results_of(TuneJob job, fitting::Evaluator& evaluator, const RationalMap& map);

/// Largest difference over the largest number. NaN differs infinitely.
double largest_difference(const std::vector<double>& a, const std::vector<double>& b);

/// The jobs over one workload with one device's settings.
class TuneBench {
 public:
  TuneBench(const Device& device, const Workload& work, Precision precision);

  std::vector<double> run(TuneJob job);
  /// Seconds on the device.
  double time(TuneJob job);

 private:
  fitting::Evaluator& evaluator(TuneJob job) {
    return job == TuneJob::orbit_energy || job == TuneJob::orbit_gradient ? *orbit_ : *potential_;
  }

  Device device_;
  const RationalMap& map_;
  std::unique_ptr<fitting::Evaluator> potential_, orbit_;
};

}  // namespace qjulia::profiling
