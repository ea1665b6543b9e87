#include "fit/fit_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "fit/budget.hpp"
#include "fit/checkpoint.hpp"
#include "fit/factor_count.hpp"
#include "fit/initial_map.hpp"
#include "fit/placement.hpp"
#include "fit/schedule.hpp"
#include "mesh/coarse_mesh.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/detail.hpp"
#include "qjulia/mesh/radial_spread.hpp"

namespace qjulia::fitting {
namespace {

/// Seconds kept from a time limit for lifting misplaced factors, scaling, calibration and writing.
constexpr double kReserve = 1.0;

/// Samples of the largest stage that draws them from the pool.
int largest_draw(const Schedule& schedule) {
  int most = 0;
  for (const Level& level : schedule.levels) {
    if (level.points == Points::surface) most = std::max(most, level.samples);
  }
  return most;
}

/// A fit that makes less than this part of its evaluations has seldom settled: its last stages,
/// which bring the surface in, have hardly begun.
constexpr int kSettlingShare = 10;

/// A warning about a fit that ended early; empty when it has had its time.
std::string unsettled(const FitResult& result, int planned) {
  if (result.evaluations == 0) {
    return "the fit ended before its first evaluation: the map is only where its factors begin";
  }
  if (result.stopped != StopReason::time_limit || result.evaluations >= planned / kSettlingShare) {
    return {};
  }
  return fmt::format(
      "the time limit ended the fit after {} of {} evaluations, before it could "
      "settle; {} factors need about {:.0f} s here, and fewer settle sooner",
      result.evaluations, planned, result.map.dynamics.factors.size(),
      result.seconds * planned / kSettlingShare / result.evaluations);
}

/// A warning about a map that cannot have the wanted detail; empty when it has.
std::string other_detail(const Map& map, double wanted) {
  if (*map.frame.detail >= wanted) return {};
  return fmt::format(
      "the map has a detail of {:.3g} and not {:.3g}, with which its set would not be bounded; "
      "more factors or more time allow a larger one",
      *map.frame.detail, wanted);
}

/// A shape measured with as many triangles as there is time for.
struct MeasuredShape {
  Shape shape;
  std::vector<std::string> warnings;  ///< about what was left out, a sentence each
};

/// @param most triangles; if the mesh has more, a coarser one is measured. @throws InputError
MeasuredShape measured_shape(const Device& device, const TriangleMesh& mesh, double most,
                             const std::stop_token& stop) {
  const auto triangles = static_cast<double>(mesh.triangles.size());
  MeasuredShape measured;
  if (triangles <= most) {
    measured.shape = make_shape(device, mesh, stop);
  } else {
    const auto [coarse, cell] = shape::coarse_mesh(mesh, static_cast<std::size_t>(most), stop);
    const Box box = mesh.box();
    try {
      measured.shape = make_shape(device, coarse, stop);
    } catch (const InputError& error) {
      throw InputError(fmt::format(
          "the time limit is too short to measure all {} triangles of the mesh, and a coarser mesh "
          "of {} cannot be fitted: {}; or start the fit with a limit of {:.0f} s or more",
          mesh.triangles.size(), coarse.triangles.size(), error.what(), least_limit(triangles)));
    }
    measured.shape.box = box;
    measured.warnings.push_back(fmt::format(
        "the fit started with too short a time limit to measure all {} triangles of the mesh: it "
        "used a coarser mesh of {}, without details smaller than {:.2g} % of the longest side; "
        "to fit the whole mesh, start with a limit of {:.0f} s or more",
        mesh.triangles.size(), coarse.triangles.size(), 100 * cell / box.size().maxCoeff(),
        least_limit(triangles)));
  }
  if (measured.shape.has_hidden_parts) {
    measured.warnings.emplace_back(
        "parts of the mesh overlap or lie within one another; it is fitted as their union");
  }
  return measured;
}

/// Does work as a named stage of the monitor's trace.
template <class Work>
auto in_stage(const ProgressMonitor& monitor, const char* name, const Work& work) {
  const TraceStage stage(monitor.trace, name);
  return work();
}

/// The map that a fit starts from.
Map placed(const Problem& problem, const SamplePool& pool, FitPlan& plan) {
  const FitOptions& options = plan.options;
  const EvaluatorFactory make_evaluator = [&](const Samples& samples,
                                              const EnergySettings& energy) {
    return problem.evaluator(samples, energy);
  };
  const int factors = in_stage(plan.monitor, "number of factors", [&] {
    return chosen_factors(options, plan.schedule, make_evaluator, pool, plan.budget);
  });
  return in_stage(plan.monitor, "placement", [&] {
    return options.placement == Placement::paper
               ? place_monopoles(pool, factors, options.seed)
               : place_factors(make_evaluator, pool, factors, options.seed);
  });
}

/// @throws OptionError if the device cannot hold what even the smallest evaluations need.
void expect_room(const Device& device, const FitOptions& options, const Schedule& schedule) {
  constexpr double kMiB = 1 << 20;
  const auto cells = [](const Level& level) {
    const auto samples = static_cast<std::size_t>(level.samples);
    return level.points == Points::grid ? samples * samples * samples : samples;
  };
  std::size_t samples = 0;
  for (const Level& level : schedule.levels) samples = std::max(samples, cells(level));
  const auto factors = static_cast<std::size_t>(options.factors.value_or(kLeastFactors));
  const energy::DeviceNeed need =
      energy::device_need(samples / static_cast<std::size_t>(options.sample_parts.value()), factors,
                          device.tuning(options.precision), options.precision);
  const DeviceInfo& info = device.info();
  const bool fits = need.largest <= info.largest_allocation;
  if (fits && need.all <= info.global_memory) return;
  throw OptionError(
      options.factors ? "factors" : "schedule",
      fmt::format("{} factors over {} samples need {:.0f} MiB on the device, and '{}' takes at "
                  "most {:.0f} MiB{}; give fewer factors, a schedule with fewer samples or another "
                  "device",
                  factors, samples, static_cast<double>(fits ? need.all : need.largest) / kMiB,
                  info.name,
                  static_cast<double>(fits ? info.global_memory : info.largest_allocation) / kMiB,
                  fits ? "" : " in one buffer"));
}

}  // namespace

FitRun::Prepared FitRun::prepared(Team& team, const Device& device, const TriangleMesh& mesh,
                                  FitOptions options, ProgressMonitor monitor) {
  options.validate();
  mesh.validate();
  if (!options.sample_parts) options.sample_parts = team.size();
  expect_room(device, options, schedule_of(options));
  Clock clock = team.shared(start_clock(monitor.stop));
  monitor.report({"measuring the mesh", 0, -1, ""});
  const bool is_kept = !options.checkpoint.empty();
  Checkpoint checkpoint(options.checkpoint, is_kept ? fit_key(mesh, options, device) : "",
                        Checkpoint::kInterval, options.observer.on_warning);
  auto kept = checkpoint.state_in(team.broadcast_text(options.resume ? checkpoint.read() : ""));
  const double most = kept ? kept->most_triangles : most_triangles(options.most_seconds());
  MeasuredShape measured = in_stage(monitor, "measure the mesh", [&] {
    return measured_shape(device, mesh, most, monitor.stop);
  });
  Shape& shape = measured.shape;
  const RadialSpread spread = radial_spread(shape.mesh, Eigen::Vector3d::Zero());
  const double detail =
      team.broadcast({chosen_detail(options.detail, spread, kFittedRule)}).front();
  Schedule schedule = schedule_of(options);
  if (options.polish) schedule = with_polish(std::move(schedule), detail);
  const int planned = kept ? kept->planned : planned_evaluations(options, schedule);
  SignedDistance distance = in_stage(monitor, "signed distance", [&] {
    return SignedDistance(device, shape.mesh, Precision::single, monitor.stop);
  });
  SamplePool pool = in_stage(monitor, "sample pool", [&] {
    return make_sample_pool(shape, distance, options.seed, planned, largest_draw(schedule),
                            monitor.stop);
  });
  team.adopt(pool);
  Budget budget(options, planned, kReserve, std::move(clock));
  return {
      {std::move(shape), std::move(distance), std::move(pool), detail, std::move(measured.warnings),
       options.steepness, options.up ? options.up : guess_up(mesh)},
      {options, std::move(schedule), std::move(budget), std::move(checkpoint), std::move(monitor),
       most},
      std::move(kept)};
}

FitRun::FitRun(Team& team, const Device& device, const TriangleMesh& mesh, FitOptions options,
               ProgressMonitor monitor)
    : FitRun(team, device, prepared(team, device, mesh, std::move(options), std::move(monitor))) {}

FitRun::FitRun(Team& team, const Device& device, Prepared prepared)
    : monitor_(prepared.plan.monitor),
      own_(in_stage(monitor_, "overlap points",
                    [&] {
                      // A rank that left a draw would keep the others waiting, so several ranks do
                      // not stop a draw.
                      const bool can_stop = team.size() == 1;
                      return MeshProblem(device, std::move(prepared.mesh),
                                         prepared.plan.options.weights,
                                         prepared.plan.options.precision,
                                         can_stop ? monitor_.stop : std::stop_token());
                    })),
      problem_(team, own_, *prepared.plan.options.sample_parts),
      stages_(begun(device, std::move(prepared))) {}

Stages FitRun::begun(const Device& device, Prepared prepared) const {
  FitPlan& plan = prepared.plan;
  const MeasuredMesh& mesh = own_.mesh();
  std::optional<FitState>& kept = prepared.kept;
  Map start = kept ? kept->map
              : plan.options.initial
                  ? started_from(device, *plan.options.initial, mesh.shape, mesh.pool)
                  : placed(problem_, mesh.pool, plan);
  if (const auto& on_stage = plan.options.observer.on_stage; !kept && on_stage) {
    const Map finished = own_.finished(start).map;
    on_stage({"placement", 0, 0, 0, 0, own_.overlap(finished, 1)}, finished);
  }
  Stages stages(problem_, std::move(start), std::move(plan));
  if (kept) stages.resume(std::move(*kept));
  return stages;
}

Map FitRun::map() const { return stages_.finished().map; }

double FitRun::overlap_of_shape(const FitResult& result) const {
  if (!result.stages.empty() && result.stages.back().iterations == 1) {
    return result.stages.back().iou;
  }
  return problem_.overlap(result.map, 1);
}

FitResult FitRun::result() {
  FitResult result;
  result.stopped = stages_.stopped().value();
  result.stages = stages_.reports();
  result.warnings = own_.mesh().warnings;
  FinishedMap finished = in_stage(monitor_, "calibration", [&] { return stages_.finished(); });
  result.map = std::move(finished.map);
  result.mean_distance = own_.mean_distance(result.map);
  finished.warnings.insert(finished.warnings.begin(),
                           own_.poor_fit(result.map, overlap_of_shape(result)));
  Budget& budget = stages_.budget();
  budget.update();
  result.evaluations = budget.evaluations();
  result.seconds = budget.seconds();
  finished.warnings.push_back(unsettled(result, budget.most_evaluations()));
  finished.warnings.push_back(other_detail(result.map, own_.mesh().detail));
  std::erase(finished.warnings, "");
  std::ranges::move(finished.warnings, std::back_inserter(result.warnings));
  if (const std::string& problem = stages_.checkpoint().problem(); !problem.empty()) {
    result.warnings.push_back(problem);
  }
  return result;
}

FitResult FitRun::whole() {
  stages_.run();
  return result();
}

}  // namespace qjulia::fitting
