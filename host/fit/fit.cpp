#include "qjulia/fit.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/range_check.hpp"
#include "fit/budget.hpp"
#include "fit/checkpoint.hpp"
#include "fit/factor_count.hpp"
#include "fit/initial_map.hpp"
#include "fit/mesh_problem.hpp"
#include "fit/placement.hpp"
#include "fit/schedule.hpp"
#include "fit/stages.hpp"
#include "fit/team.hpp"
#include "qjulia/detail.hpp"
#include "qjulia/error.hpp"
#include "shape/coarse_mesh.hpp"

namespace qjulia {

using namespace fitting;
namespace {

constexpr int kMostFactors = 20'000;

/// Checks a map to start from. @param factors the number asked for, if one is.
void check_initial(const Map& map, const std::optional<int>& factors) {
  map.validate();
  if (!map.dynamics.is_rational()) {
    throw OptionError("initial",
                      fmt::format("the map is {}; give a rational one", map.dynamics.kind()));
  }
  const auto count = static_cast<int>(map.dynamics.factors.size());
  base::expect_between("initial", count, kLeastFactors, kMostFactors, "factors");
  if (!factors || *factors == count) return;
  throw OptionError("factors",
                    fmt::format("{} are asked for, but the initial map has {}; leave the "
                                "number out, or give that one",
                                *factors, count));
}

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
  if (map.dynamics.degree() <= 1) {
    return fmt::format(
        "the map's exponents sum to {:.3g}, and its set is bounded only where they exceed 1: "
        "use 1 iteration, or fit it again with more factors or more time",
        map.dynamics.degree());
  }
  if (*map.frame.detail >= wanted) return {};
  return fmt::format(
      "the map has a detail of {:.3g} and not {:.3g}, with which its set would not be bounded; "
      "more factors or more time allow a larger one",
      *map.frame.detail, wanted);
}

/// The map with all that a user gets with it: its steepness, and which axis is up.
Map dressed(Map map, const FitOptions& options, const TriangleMesh& mesh) {
  map.layers.steepness = options.steepness;
  map.frame.up = options.up ? options.up : guess_up(mesh);
  return map;
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

/// The result of a fit of the mesh that has ended.
FitResult result_of(Stages& stages, StopReason stopped, const MeshProblem& problem,
                    const FitOptions& options, const TriangleMesh& mesh,
                    const ProgressMonitor& monitor) {
  FitResult result;
  result.stopped = stopped;
  result.stages = stages.reports();
  result.warnings = problem.mesh().warnings;
  FinishedMap finished = in_stage(monitor, "calibration", [&] { return stages.finished(); });
  for (std::string& warning : finished.warnings) result.warnings.push_back(std::move(warning));
  result.mean_distance = problem.mean_distance(finished.map);
  result.map = dressed(std::move(finished.map), options, mesh);
  stages.budget().update();
  result.evaluations = stages.budget().evaluations();
  result.seconds = stages.budget().seconds();
  for (std::string warning : {unsettled(result, stages.budget().most_evaluations()),
                              other_detail(result.map, problem.mesh().detail)}) {
    if (!warning.empty()) result.warnings.push_back(std::move(warning));
  }
  if (const std::string& failure = stages.checkpoint().problem(); !failure.empty()) {
    result.warnings.push_back("the fit could not be kept while it was under way: " + failure);
  }
  return result;
}

FitResult fit_in(Team& team, const Device& device, const TriangleMesh& mesh,
                 const FitOptions& options, const ProgressMonitor& monitor) {
  options.validate();
  mesh.validate();
  Clock clock = team.shared(start_clock(monitor.stop));
  monitor.report({"measuring the mesh", 0, -1, ""});
  Checkpoint checkpoint(options.checkpoint, fit_key(mesh, options, device));
  auto kept = checkpoint.state_in(team.broadcast_text(options.resume ? checkpoint.read() : ""));
  const double most = kept ? kept->most_triangles : most_triangles(options.time_limit);
  MeasuredShape measured = in_stage(monitor, "measure the mesh", [&] {
    return measured_shape(device, mesh, most, monitor.stop);
  });
  Shape& shape = measured.shape;
  const double detail =
      team
          .broadcast({chosen_detail(
              options.detail, radial_spread(shape.mesh, Eigen::Vector3d::Zero()), kFittedRule)})
          .front();
  Schedule schedule = schedule_of(options);
  if (options.polish) schedule = with_polish(std::move(schedule), detail);
  const int planned = kept ? kept->planned : planned_evaluations(options, schedule);
  Budget budget(options, planned, kReserve, std::move(clock));
  SignedDistance distance = in_stage(monitor, "signed distance", [&] {
    return SignedDistance(device, shape.mesh, Precision::single, monitor.stop);
  });
  SamplePool pool = in_stage(monitor, "sample pool", [&] {
    return make_sample_pool(shape, distance, options.seed, planned, largest_draw(schedule),
                            monitor.stop);
  });
  team.adopt(pool);
  // A rank that left a draw would keep the others waiting, so several ranks do not stop a draw.
  const std::stop_token draw_stop = team.size() > 1 ? std::stop_token() : monitor.stop;
  const MeshProblem own = in_stage(monitor, "overlap points", [&] {
    return MeshProblem(device,
                       {std::move(shape), std::move(distance), std::move(pool), detail,
                        std::move(measured.warnings)},
                       options.precision, draw_stop);
  });
  const DividedProblem problem(team, own, options.sample_parts);

  FitPlan plan{options, std::move(schedule), std::move(budget), std::move(checkpoint), monitor,
               most};
  FitObserver& observer = plan.options.observer;
  if (options.observer.on_stage) {
    observer.on_stage = [&](const StageReport& stage, const Map& map) {
      options.observer.on_stage(stage, dressed(map, options, mesh));
    };
  }
  Map start = kept ? kept->map
              : options.initial
                  ? started_from(device, *options.initial, own.mesh().shape, own.mesh().pool)
                  : placed(problem, own.mesh().pool, plan);
  if (!kept && observer.on_stage) {
    const double iou = own.overlap(start, 1);
    observer.on_stage({"placement", 0, 0, 0, 0, iou}, own.finished(start, iou).map);
  }
  Stages stages(problem, std::move(start), std::move(plan));
  if (kept) stages.resume(std::move(*kept));
  const StopReason stopped = stages.run();
  return result_of(stages, stopped, own, options, mesh, monitor);
}

}  // namespace

void FitOptions::validate() const {
  if (factors) base::expect_between("factors", *factors, kLeastFactors, kMostFactors);
  base::expect_between("max_factors", max_factors, kLeastFactors, kMostFactors);
  if (const auto* number = std::get_if<double>(&detail)) {
    base::expect_between("detail", *number, kLeastDetail, kMostDetail, "of the box's diagonal");
  }
  base::expect_between("steepness", steepness, 1.0, kMostSteepness);
  if (!(time_limit > 0)) {
    throw OptionError("time_limit",
                      fmt::format("{} is out of range; give more than 0 seconds", time_limit));
  }
  if (max_evaluations) {
    base::expect_between("max_evaluations", *max_evaluations, 1, std::numeric_limits<int>::max());
  }
  if (!(target_iou > 0 && target_iou <= 1)) {
    throw OptionError(
        "target_iou",
        fmt::format("{} is out of range; give a number above 0, up to 1", target_iou));
  }
  base::expect_between("sample_parts", sample_parts, 1, 1024);
  schedule_of(*this);
  if (initial) check_initial(*initial, factors);
}

std::string to_string(StopReason reason) {
  switch (reason) {
    case StopReason::schedule_done:
      return "the schedule is done";
    case StopReason::evaluations:
      return "the evaluations asked for are done";
    case StopReason::time_limit:
      return "the time limit was reached";
    case StopReason::target_iou:
      return "the target IoU was reached";
    case StopReason::interrupted:
      return "it was interrupted";
    case StopReason::converged:
      break;
  }
  return "it converged";
}

std::string brief_summary(const FitResult& result) {
  std::string text;
  if (!result.stages.empty()) {
    const StageReport& last = result.stages.back();
    text = fmt::format(
        "IoU {:.3f} at n = {} on a coarse grid, mean distance {:.3g} % of the diagonal\n", last.iou,
        last.iterations, 100 * result.mean_distance);
  }
  return text + fmt::format("{} factors, {} evaluations in {:.1f} s; ended: {}",
                            result.map.dynamics.factors.size(), result.evaluations, result.seconds,
                            to_string(result.stopped));
}

std::string full_summary(const FitResult& result) {
  std::string text;
  for (const StageReport& stage : result.stages) {
    text += fmt::format(
        "stage {:16} {:5} evaluations {:8.1f} s  energy {:10.4g} -> {:10.4g}  IoU {:.4f} at n = "
        "{}\n",
        stage.name, stage.evaluations, stage.seconds, stage.energy_before, stage.energy_after,
        stage.iou, stage.iterations);
  }
  return text + brief_summary(result);
}

FitResult fit(const Device& device, const TriangleMesh& mesh, const FitOptions& options,
              const ProgressMonitor& monitor) {
  Team alone;
  return fit_in(alone, device, mesh, options, monitor);
}

FitResult fit(const Device& device, const TriangleMesh& mesh, const FitOptions& options,
              const ProgressMonitor& monitor, Ranks& ranks) {
  Team team(ranks);
  ProgressMonitor mine = monitor;
  FitOptions own = options;
  if (team.rank() > 0) {
    mine = {{}, {}, monitor.trace};
    own.checkpoint.clear();
    own.observer.on_stage = {};
  }
  return team.run([&] {
    own.time_limit = team.broadcast({options.time_limit}).front();
    return fit_in(team, device, mesh, own, mine);
  });
}

}  // namespace qjulia
