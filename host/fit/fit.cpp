#include "qjulia/fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <optional>

#include "base/range_check.hpp"
#include "fit/budget.hpp"
#include "fit/checkpoint.hpp"
#include "fit/factor_count.hpp"
#include "fit/finish_map.hpp"
#include "fit/placement.hpp"
#include "fit/sample_pool.hpp"
#include "fit/schedule.hpp"
#include "fit/stages.hpp"
#include "fit/team.hpp"
#include "qjulia/detail.hpp"
#include "qjulia/error.hpp"
#include "qjulia/field.hpp"
#include "shape/overlap.hpp"

namespace qjulia {

using namespace fitting;
namespace {

constexpr int kMostFactors = 20'000;

/// Seconds kept from a time limit for lifting misplaced factors, scaling, calibration and writing.
constexpr double kReserve = 1.0;

/// What gives the IoU of {F_n < map.surface_level} and the inside of the shape, 0 … 1, over the
/// cells of a coarse cube about it, for reports.
std::function<double(const RationalMap&, int)> coarse_overlap(const Device& device,
                                                              const TriangleMesh& mesh,
                                                              const SignedDistance& distance) {
  constexpr int kCells = 48;
  constexpr double kMargin = 1.1;
  const Box box = mesh.box();
  const double side = kMargin * box.size().maxCoeff();
  const Eigen::Vector3d corner = box.center() - Eigen::Vector3d::Constant(side / 2);
  std::vector<Eigen::Vector3d> points;
  for (int x = 0; x < kCells; ++x) {
    for (int y = 0; y < kCells; ++y) {
      for (int z = 0; z < kCells; ++z) {
        points.emplace_back(corner + side / kCells * Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5));
      }
    }
  }
  std::vector<bool> inside;
  for (const double d : distance.at(points)) inside.push_back(d < 0);
  return [device, inside, cells = on_slice(points, 0)](const RationalMap& map, int iterations) {
    const auto field = Field(device, map).at(cells, iterations);
    shape::Overlap overlap;
    for (std::size_t i = 0; i < field.size(); ++i) {
      overlap.add(field[i] < map.surface_level, inside[i]);
    }
    return overlap.iou();
  };
}

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
      result.evaluations, planned, result.map.factors.size(),
      result.seconds * planned / kSettlingShare / result.evaluations);
}

/// A warning about a map that cannot have the wanted detail; empty when it has.
std::string other_detail(const RationalMap& map, double wanted) {
  if (map.degree() <= 1) {
    return fmt::format(
        "the map's exponents sum to {:.3g}, and its set is bounded only where they exceed 1: "
        "use 1 iteration, or fit it again with more factors or more time",
        map.degree());
  }
  if (*map.detail >= wanted) return {};
  return fmt::format(
      "the map has a detail of {:.3g} and not {:.3g}, with which its set would not be bounded; "
      "more factors or more time allow a larger one",
      *map.detail, wanted);
}

FitResult fit_in(Team& team, const Device& device, const TriangleMesh& mesh,
                 const FitOptions& options, const ProgressMonitor& monitor) {
  options.validate();
  mesh.validate();
  Clock clock = team.shared(start_clock(monitor.stop));
  EvaluatorFactory make_evaluator = [&](const Samples& samples, const EnergyOptions& energy) {
    return make_device_evaluator(device, samples, energy, options.precision);
  };
  if (team.size() > 1 || options.sample_parts > 1) {
    make_evaluator = distributed(team, std::move(make_evaluator), options.sample_parts);
  }
  monitor.report({"measuring the mesh", 0, -1, ""});
  const auto in_stage = [&](const char* name, const auto& work) {
    const TraceStage stage(monitor.trace, name);
    return work();
  };
  const Shape shape =
      in_stage("measure the mesh", [&] { return make_shape(device, mesh, monitor.stop); });
  const double detail =
      team.broadcast({chosen_detail(options.detail, thinness(shape.mesh), kFittedShare)}).front();
  Schedule schedule = find_schedule(options.schedule);
  if (options.polish) schedule = with_polish(std::move(schedule), detail);
  Checkpoint checkpoint(team.rank() == 0 ? options.checkpoint : "", fit_key(mesh, options, device));
  auto kept = checkpoint.state_in(team.broadcast_text(options.resume ? checkpoint.read() : ""));
  const int planned = kept ? kept->planned : planned_evaluations(options, schedule);
  Budget budget(options, planned, kReserve, std::move(clock));
  FitResult result;
  if (shape.has_hidden_parts) {
    result.warnings.emplace_back(
        "parts of the mesh overlap or lie within one another; it is fitted as their union");
  }
  const SignedDistance distance = in_stage("signed distance", [&] {
    return SignedDistance(device, shape.mesh, Precision::single, monitor.stop);
  });
  SamplePool pool = in_stage("sample pool", [&] {
    return make_sample_pool(shape, distance, options.seed, planned, largest_draw(schedule));
  });
  team.adopt(pool);
  const auto coarse_iou =
      in_stage("overlap points", [&] { return coarse_overlap(device, shape.mesh, distance); });
  const auto place = [&] {
    const int factors = in_stage("number of factors", [&] {
      return chosen_factors(options, schedule, make_evaluator, pool, budget);
    });
    return in_stage("placement", [&] {
      return options.placement == Placement::paper
                 ? place_monopoles(pool, factors, options.seed)
                 : place_factors(make_evaluator, pool, factors, options.seed);
    });
  };
  RationalMap placed = kept ? kept->map : place();
  const auto draw = [&](const Level& level, base::Random& random) {
    Samples samples = level.points == Points::grid ? grid_samples(shape, distance, level)
                                                   : pool.draw(level, random);
    team.adopt(samples);
    return samples;
  };
  const auto distances = [&](const std::vector<Eigen::Vector3d>& points) {
    std::vector<double> found = distance.at(points);
    team.adopt(found);
    return found;
  };
  const auto agreed = [&](RationalMap map) {
    team.adopt(map);
    return map;
  };
  const auto overlap = [&](const RationalMap& map, int n) {
    return team.broadcast({coarse_iou(map, n)}).front();
  };
  const auto with_detail = [&](const RationalMap& map, double iou) {
    return finish_map(device, map, iou, shape, pool, detail, result.warnings);
  };
  const auto dressed = [&](RationalMap map) {
    map.tufts = options.tufts;
    map.up = options.up ? options.up : guess_up(mesh);
    return map;
  };
  const auto on_stage = [&](const StageReport& stage, const RationalMap& map) {
    if (!options.observer.on_stage || team.rank() != 0) return;
    std::vector<std::string> ignored;  // the fit goes on
    options.observer.on_stage(
        stage, dressed(finish_map(device, map, stage.iou, shape, pool, detail, ignored)));
  };
  if (!kept && options.observer.on_stage) {
    on_stage({"placement", 0, 0, 0, 0, coarse_iou(placed, 1)}, placed);
  }
  Stages stages(std::move(placed), {draw, overlap, with_detail, distances, on_stage, agreed},
                make_evaluator, options, schedule, budget, checkpoint, monitor);
  if (kept) stages.resume(std::move(*kept));

  result.stopped = stages.run();
  result.stages = stages.reports();
  result.map = in_stage("calibration", [&] { return stages.map(); });
  result.mean_distance = mean_distance(device, result.map, pool);
  result.map = dressed(std::move(result.map));
  budget.update();
  result.evaluations = budget.evaluations();
  result.seconds = budget.seconds();
  for (std::string warning : {unsettled(result, planned), other_detail(result.map, detail)}) {
    if (!warning.empty()) result.warnings.push_back(std::move(warning));
  }
  if (!checkpoint.problem().empty()) {
    result.warnings.push_back("the fit could not be kept while it was under way: " +
                              checkpoint.problem());
  }
  return result;
}

}  // namespace

void FitOptions::validate() const {
  if (factors != 0) base::expect_between("factors", factors, kLeastFactors, kMostFactors);
  base::expect_between("max_factors", max_factors, kLeastFactors, kMostFactors);
  if (const auto* number = std::get_if<double>(&detail)) {
    base::expect_between("detail", *number, kLeastDetail, kMostDetail, "of the box's diagonal");
  }
  base::expect_between("tufts", tufts, 1.0, kMostTufts);
  if (!(time_limit > 0)) {
    throw OptionError("time_limit",
                      fmt::format("{} is out of range; give more than 0 seconds", time_limit));
  }
  base::expect_between("max_evaluations", max_evaluations, 0, std::numeric_limits<int>::max());
  if (!(target_iou > 0 && target_iou <= 1)) {
    throw OptionError(
        "target_iou",
        fmt::format("{} is out of range; give a number above 0, up to 1", target_iou));
  }
  base::expect_between("sample_parts", sample_parts, 1, 1024);
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
                            result.map.factors.size(), result.evaluations, result.seconds,
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
  const ProgressMonitor mine = team.rank() == 0 ? monitor : ProgressMonitor{{}, {}, monitor.trace};
  FitOptions agreed = options;
  return team.run([&] {
    agreed.time_limit = team.broadcast({options.time_limit}).front();
    return fit_in(team, device, mesh, agreed, mine);
  });
}

}  // namespace qjulia
