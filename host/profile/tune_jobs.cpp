#include "profile/tune_jobs.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "profile/stopwatch.hpp"

namespace qjulia::profiling {
namespace {

constexpr int kOrbitIterations = 4;

std::unique_ptr<fitting::Evaluator> make(const Device& device, const Workload& work, int iterations,
                                         Precision precision) {
  fitting::EnergyOptions options;
  options.iterations = iterations;
  options.escape = kNoEscape;
  return fitting::make_device_evaluator(device, work.samples, options, precision);
}

}  // namespace

std::vector<double> results_of(TuneJob job, fitting::Evaluator& evaluator, const RationalMap& map) {
  if (job == TuneJob::gauss_newton) {
    const Eigen::MatrixXd h = evaluator.gauss_newton(map);
    return {h.data(), h.data() + h.size()};
  }
  const bool with_gradient = job == TuneJob::gradient || job == TuneJob::orbit_gradient;
  fitting::Evaluation evaluation = evaluator.evaluate(map, with_gradient);
  if (!with_gradient) return {evaluation.energy};
  return std::move(evaluation.gradient);
}

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() != b.size()) return std::numeric_limits<double>::infinity();
  double difference = 0, largest = std::numeric_limits<double>::min();
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double d = std::abs(a[i] - b[i]);
    if (std::isnan(d)) return std::numeric_limits<double>::infinity();
    difference = std::max(difference, d);
    largest = std::max(largest, std::abs(b[i]));
  }
  return difference / largest;
}

TuneBench::TuneBench(const Device& device, const Workload& work, Precision precision)
    : device_(device),
      map_(work.map),
      potential_(make(device, work, 1, precision)),
      orbit_(make(device, work, kOrbitIterations, precision)) {}

std::vector<double> TuneBench::run(TuneJob job) { return results_of(job, evaluator(job), map_); }

double TuneBench::time(TuneJob job) {
  return timed(device_, [&] { run(job); }).device;
}

}  // namespace qjulia::profiling
