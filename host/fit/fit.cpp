#include "qjulia/fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "fit/budget.hpp"
#include "fit/checkpoint.hpp"
#include "fit/finish.hpp"
#include "fit/monopoles.hpp"
#include "fit/overlap.hpp"
#include "fit/placement.hpp"
#include "fit/ranked_evaluator.hpp"
#include "fit/sample_pool.hpp"
#include "fit/schedule.hpp"
#include "fit/stages.hpp"
#include "qjulia/error.hpp"

namespace qjulia {
namespace {

/// Seconds kept from a time limit for scaling, calibration and writing.
constexpr double kReserve = 1.0;

class OneRank final : public Ranks {
 public:
  int rank() const override { return 0; }
  int size() const override { return 1; }
  std::vector<int> all(int value) override { return {value}; }
  void broadcast(Numbers&) override {}
  Numbers scatter(const std::vector<Numbers>& parts) override { return parts.front(); }
  std::vector<Numbers> gather(const Numbers& mine) override { return {mine}; }
};

template <class Number>
void expect_between(const char* option, Number value, Number low, Number high, const char* what) {
  if (value >= low && value <= high) return;  // false for NaN
  throw InputError(
      fmt::format("{} {}: {} must lie between {} and {}", option, value, what, low, high));
}

/// Samples of the largest stage that draws them from the pool.
int largest_draw(const Schedule& schedule) {
  int most = 0;
  for (const Level& level : schedule.levels) {
    if (level.points == Points::surface) most = std::max(most, level.samples);
  }
  return most;
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
  expect_between("--sample-parts", sample_parts, 1, 100'000, "the number of parts");
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
  OneRank alone;
  return fit(device, mesh, options, watch, alone);
}

FitResult fit(const Device& device, const TriangleMesh& mesh, const FitOptions& options,
              const Watch& watch, Ranks& ranks) {
  std::optional<RankedEvaluators> ranked;
  EvaluatorFactory make_evaluator = [&](const Samples& samples, const EnergyOptions& energy) {
    return make_device_evaluator(device, samples, energy, options.precision);
  };
  if (ranks.size() > 1 || options.sample_parts > 1) {
    ranked.emplace(ranks, make_evaluator, options.sample_parts);
    make_evaluator = ranked->factory();
  }
  options.validate();
  const auto start = Budget::Clock::now();
  Schedule schedule = find_schedule(options.schedule);
  if (options.polish) schedule = with_polish(std::move(schedule), options.detail);
  Budget budget(options, schedule.evaluations, start, kReserve, watch.stop);

  watch.report({"measuring the mesh", 0, -1, ""});
  const auto in_stage = [&](const char* name, const auto& work) {
    const TraceStage stage(watch.trace, name);
    return work();
  };
  const Shape shape = in_stage("measure the mesh", [&] { return make_shape(device, mesh); });
  FitResult result;
  if (shape.has_hidden_parts) {
    result.warnings.emplace_back(
        "parts of the mesh overlap or lie within one another; it is fitted as their union");
  }
  const SignedDistance distance =
      in_stage("signed distance", [&] { return SignedDistance(device, shape.mesh); });
  const SamplePool pool = in_stage("sample pool", [&] {
    return make_sample_pool(
        shape, distance, options.seed,
        options.max_evaluations > 0 ? options.max_evaluations : schedule.evaluations,
        largest_draw(schedule));
  });
  const Overlap overlap =
      in_stage("overlap points", [&] { return Overlap(device, shape, distance); });
  Checkpoint checkpoint(options.checkpoint, fit_key(mesh, options, device));
  auto kept = options.resume ? checkpoint.load() : std::nullopt;
  const RationalMap placed = kept ? kept->map : in_stage("placement", [&] {
    return options.placement == Placement::paper
               ? place_monopoles(pool, options.factors, options.seed)
               : place_factors(make_evaluator, pool, options.factors, options.seed);
  });
  const auto draw = [&](const Level& level, Random& random) {
    return level.points == Points::grid ? grid_samples(shape, distance, level)
                                        : pool.draw(level, random);
  };
  const auto with_detail = [&](const RationalMap& map, double iou) {
    return finished(device, map, iou, shape, pool, options.detail, result.warnings);
  };
  Stages stages(placed, {draw, overlap, with_detail}, make_evaluator, options, schedule, budget,
                checkpoint, watch);
  if (kept) stages.resume(std::move(*kept));

  result.stopped = stages.run();
  result.stages = stages.reports();
  result.map = in_stage("calibration", [&] { return stages.map(); });
  result.evaluations = budget.evaluations();
  result.seconds = budget.seconds();
  return result;
}

void serve_fit(Ranks& ranks, const std::function<Device()>& open, Precision precision) {
  std::optional<Device> device;
  serve_evaluations(ranks, [&](const Samples& samples, const EnergyOptions& energy) {
    if (!device) device = open();
    return make_device_evaluator(*device, samples, energy, precision);
  });
}

}  // namespace qjulia
