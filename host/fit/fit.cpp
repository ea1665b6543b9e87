#include "qjulia/fit.hpp"

#include <fmt/format.h>

#include <cmath>

#include "fit/budget.hpp"
#include "fit/minimize.hpp"
#include "fit/overlap.hpp"
#include "fit/placement.hpp"
#include "fit/relocate.hpp"
#include "fit/sample_pool.hpp"
#include "fit/schedule.hpp"
#include "qjulia/detail.hpp"
#include "qjulia/error.hpp"
#include "qjulia/field.hpp"

namespace qjulia {
namespace {

/// Seconds kept from a time limit for scaling, calibration and writing.
constexpr double kReserve = 1.0;

std::vector<std::size_t> active_unknowns(Unknowns unknowns, std::size_t factors) {
  const std::size_t count = unknowns == Unknowns::all ? 1 + 5 * factors : 1 + factors;
  std::vector<std::size_t> active(count);
  for (std::size_t i = 0; i < count; ++i) active[i] = i;
  return active;
}

const Phase& phase_at(const Schedule& schedule, double fraction) {
  for (const Phase& phase : schedule.phases) {
    if (fraction < phase.until) return phase;
  }
  return schedule.phases.back();
}

/// The stages of one fit: a map whose F_1 comes ever closer to signed distance.
class Fit {
 public:
  Fit(const Device& device, const Shape& shape, const SignedDistance& distance,
      const FitOptions& options, const Schedule& schedule, Budget& budget, const Watch& watch)
      : device_(device),
        options_(options),
        schedule_(schedule),
        budget_(budget),
        watch_(watch),
        random_(options.seed),
        pool_(shape, distance, options.seed),
        overlap_(device, shape, distance),
        map_(place_factors(device, pool_, options.factors, options.precision, options.seed)) {}

  /// Runs stages until the budget is spent.
  StopReason run() {
    for (;;) {
      if (const auto reason = budget_.spent()) return *reason;
      if (const auto reason = run_stage(phase_at(schedule_, budget_.fraction()))) return *reason;
    }
  }

  const RationalMap& map() const { return map_; }
  const SamplePool& pool() const { return pool_; }
  std::vector<StageReport> stages;

 private:
  std::optional<StopReason> run_stage(const Phase& phase) {
    const double start = budget_.seconds();
    const int evaluations = budget_.evaluations();
    const Samples samples = pool_.draw(phase, random_);
    const auto evaluator = make_device_evaluator(device_, samples, {}, options_.precision);
    if (phase.relocated > 0 && !stages.empty() && options_.unknowns == Unknowns::all) {
      map_ = relocate_factors(*evaluator, samples, map_, phase.relocated, random_);
    }
    const auto active = active_unknowns(options_.unknowns, map_.factors.size());
    const Preconditioner scaling(evaluator->gauss_newton(map_), active, schedule_.damping);
    auto result = minimize(*evaluator, map_, active, scaling, phase.iterations, budget_);
    map_ = std::move(result.map);
    StageReport report{
        phase.name,          budget_.evaluations() - evaluations, result.energy_before,
        result.energy_after, budget_.seconds() - start,           overlap_(map_)};
    stages.push_back(report);
    watch_.report({"fitting", budget_.fraction(), budget_.seconds_left(),
                   fmt::format("{}, {} evaluations, energy {:.3e}, IoU {:.4f}", phase.name,
                               budget_.evaluations(), report.energy_after, report.iou)});
    return result.stopped;
  }

  const Device& device_;
  const FitOptions& options_;
  const Schedule& schedule_;
  Budget& budget_;
  const Watch& watch_;
  Random random_;
  SamplePool pool_;
  Overlap overlap_;
  RationalMap map_;
};

std::vector<Eigen::Vector3d> positions(const std::vector<SurfacePoint>& points, std::size_t count) {
  std::vector<Eigen::Vector3d> found;
  for (std::size_t i = 0; i < std::min(count, points.size()); ++i) {
    found.push_back(points[i].position);
  }
  return found;
}

/// From a map in distance units to one with the wanted shell, calibrated, in the shape's units.
RationalMap finished(const Device& device, RationalMap map, const Shape& shape,
                     const SamplePool& pool, double detail, std::vector<std::string>& warnings) {
  constexpr std::size_t kSurfacePoints = 20'000;
  const auto surface = positions(pool.surface(), kSurfacePoints);
  map.shape_to_map = shape.shape_to_map;
  map.box = shape.box;
  map.inradius = shape.inradius / shape.shape_to_map.scale;
  map.log_scale -= median_level(Field(device, map), surface, map.slice);
  map = with_measured_detail(device, map, surface, detail);
  map = calibrated(device, map);

  constexpr double kDeepEnough = -2;
  const std::vector<Quaternion> origin{{0, 0, 0, map.slice}};
  const double depth = Field(device, map).at(origin).front();
  if (depth > kDeepEnough) {
    warnings.push_back(
        fmt::format("the field at the origin is {:.2f}, above {}: the iterated set is near "
                    "dissolving; use a smaller --detail",
                    depth, kDeepEnough));
  }
  return map;
}

template <class Number>
void expect_between(const char* option, Number value, Number low, Number high, const char* what) {
  if (value >= low && value <= high) return;  // false for NaN
  throw InputError(
      fmt::format("{} {}: {} must lie between {} and {}", option, value, what, low, high));
}

}  // namespace

void FitOptions::validate() const {
  expect_between("--factors", factors, 8, 20'000, "the number of factors");
  expect_between("--detail", detail, 0.001, 0.1, "the shell's thickness over the box's diagonal");
  if (!(time_limit > 0)) {
    throw InputError(fmt::format("--time-limit {}: seconds must be positive", time_limit));
  }
  if (max_evaluations < 0) {
    throw InputError(
        fmt::format("--max-evaluations {}: the number must be positive", max_evaluations));
  }
  find_schedule(schedule);
}

std::string to_string(StopReason reason) {
  switch (reason) {
    case StopReason::schedule_done:
      return "the schedule is done";
    case StopReason::evaluations:
      return "the evaluations asked for are done";
    case StopReason::time_limit:
      return "the time limit was reached";
    case StopReason::interrupted:
      return "it was interrupted";
    case StopReason::converged:
      break;
  }
  return "it converged";
}

FitResult fit(const Device& device, const TriangleMesh& mesh, const FitOptions& options,
              const Watch& watch) {
  options.validate();
  const auto start = Budget::Clock::now();
  const Schedule& schedule = find_schedule(options.schedule);
  Budget budget(options, schedule.evaluations, start, kReserve, watch.stop);

  watch.report({"measuring the mesh", 0, -1, ""});
  const Shape shape = make_shape(device, mesh);
  const SignedDistance distance(device, shape.mesh);
  Fit stages(device, shape, distance, options, schedule, budget, watch);

  FitResult result;
  result.stopped = stages.run();
  result.map =
      finished(device, stages.map(), shape, stages.pool(), options.detail, result.warnings);
  result.stages = std::move(stages.stages);
  result.evaluations = budget.evaluations();
  result.seconds = budget.seconds();
  return result;
}

}  // namespace qjulia
