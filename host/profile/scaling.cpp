#include "qjulia/profile/scaling.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "base/range_check.hpp"
#include "device/context.hpp"
#include "energy/cost.hpp"
#include "profile/workload.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/base/progress.hpp"
#include "qjulia/map/field.hpp"

namespace qjulia {

using namespace profiling;
namespace {

/// Runs go on for this long, but are two at least and not many.
constexpr double kSecondsEach = 0.5;
constexpr int kMostRuns = 10;

ScalingPoint measure(const Device& device, const Workload& work, int iterations,
                     Precision precision, const ProgressMonitor& monitor) {
  device.context().reset_peak_allocated_bytes();
  const auto evaluator = make_evaluator(device, work, iterations, precision);
  double least = std::numeric_limits<double>::infinity(), spent = 0;
  for (int run = 0; run < 2 || (run < kMostRuns && spent < kSecondsEach); ++run) {
    throw_if_stopped(monitor.stop);
    const double seconds = timed(device, [&] { evaluator->evaluate(work.map, true); }).device;
    least = std::min(least, seconds);
    spent += seconds;
  }
  return {iterations, work.samples.size(), work.map.dynamics.factors.size(), least,
          device.context().peak_allocated_bytes()};
}

}  // namespace

void ScalingOptions::validate() const {
  ProfileOptions size;
  for (const std::size_t number : samples) {
    size.sample_points = number;
    size.validate();
  }
  for (const std::size_t number : factors) {
    size.factors = number;
    size.validate();
  }
  for (const int n : iterations) base::expect_between("iterations", n, 1, kMostIterations);
  base::expect_positive("most_slots", most_slots);
}

ScalingLaw fit_law(const std::vector<ScalingPoint>& points) {
  const auto count = static_cast<Eigen::Index>(points.size());
  Eigen::MatrixX3d sizes(count, 3);
  Eigen::VectorXd times(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const ScalingPoint& p = points[static_cast<std::size_t>(i)];
    sizes.row(i) << 1, std::log(static_cast<double>(p.samples)),
        std::log(static_cast<double>(p.factors));
    times[i] = std::log(p.seconds);
  }
  const auto decomposed = sizes.colPivHouseholderQr();
  if (!sizes.allFinite() || !times.allFinite() || decomposed.rank() < 3) {
    throw InputError(
        "a law of scaling needs three measurements that differ in samples and in factors; give "
        "more sizes");
  }
  const Eigen::Vector3d law = decomposed.solve(times);
  const double worst = (sizes * law - times).cwiseAbs().maxCoeff();
  return {points.front().iterations, law[1], law[2], std::exp(worst)};
}

ScalingReport measure_scaling(const Device& device, const ScalingOptions& options,
                              const ProgressMonitor& monitor) {
  options.validate();
  ScalingReport report;
  report.device = device.info();
  for (const int n : options.iterations) {
    std::vector<ScalingPoint> points;
    for (const std::size_t samples : options.samples) {
      ProfileOptions size;
      size.sample_points = samples;
      size.seed = options.seed;
      for (const std::size_t factors : options.factors) {
        if (static_cast<double>(samples * factors) * cost::gradient(n) > options.most_slots)
          continue;
        monitor.report({"measuring", -1, -1, fmt::format("{} x {}, n = {}", samples, factors, n)});
        size.factors = factors;
        points.push_back(measure(device, make_workload(size), n, options.precision, monitor));
      }
    }
    report.laws.push_back(fit_law(points));
    report.points.insert(report.points.end(), points.begin(), points.end());
  }
  return report;
}

std::string to_csv(const ScalingReport& report) {
  std::string text = "iterations,samples,factors,seconds,device_bytes\n";
  for (const ScalingPoint& p : report.points) {
    text += fmt::format("{},{},{},{},{}\n", p.iterations, p.samples, p.factors, p.seconds,
                        p.device_bytes);
  }
  return text;
}

nlohmann::json to_json(const ScalingReport& report) {
  nlohmann::json points = nlohmann::json::array(), laws = points;
  for (const ScalingPoint& p : report.points) {
    points.push_back({{"iterations", p.iterations},
                      {"samples", p.samples},
                      {"factors", p.factors},
                      {"seconds", p.seconds},
                      {"device_bytes", p.device_bytes}});
  }
  for (const ScalingLaw& law : report.laws) {
    laws.push_back({{"iterations", law.iterations},
                    {"samples_exponent", law.samples_exponent},
                    {"factors_exponent", law.factors_exponent},
                    {"worst_ratio", law.worst_ratio}});
  }
  return {{"device", report.device.name}, {"points", points}, {"laws", laws}};
}

}  // namespace qjulia
