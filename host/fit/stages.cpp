#include "fit/stages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "device/context.hpp"
#include "fit/relocate.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::fitting {
namespace {

int level_at(const Schedule& schedule, double fraction) {
  const auto first = schedule.levels.begin(), last = std::prev(schedule.levels.end());
  const auto goes_on = [&](const Level& level) { return fraction < level.until; };
  return static_cast<int>(std::ranges::find_if(first, last, goes_on) - first);
}

/// Whether further stages over the same samples would gain next to nothing.
bool converged(const Level& level, const MinimizeResult& result) {
  constexpr double kLeastGain = 1e-4;
  return level.points == Points::grid &&
         result.energy_before - result.energy_after < kLeastGain * std::abs(result.energy_before);
}

/// Weights times 1 + r e / mean e, e = 1 − s tanh(α (F − target)) or |F − target|. Means are taken
/// over either side for the tanh loss, whose balance of inside and outside is kept: sums stay as
/// they were.
void reweight(Samples& samples, const std::vector<double>& field, const Level& level) {
  std::vector<double> error(samples.size());
  std::array<double, 2> errors{};
  std::array<double, 2> weights{};
  const auto group = [&](std::size_t i) {
    return static_cast<std::size_t>(level.loss == Loss::tanh && samples.side[i] < 0);
  };
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double residual = field[i] - samples.target[i];
    if (level.loss == Loss::tanh) {
      error[i] = 1 - samples.side[i] * std::tanh(level.alpha * residual);
    } else if (samples.side[i] * residual <= 0) {
      error[i] = std::abs(residual);
    }
    errors[group(i)] += samples.weight[i] * error[i];
    weights[group(i)] += samples.weight[i];
  }
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double mean = errors[group(i)] / weights[group(i)];
    if (!(mean > 0)) continue;
    samples.weight[i] *= (1 + level.reweight * error[i] / mean) / (1 + level.reweight);
  }
}

/// Whether F_1 is regressed to distances at points about the surface.
bool regresses(const Level& level) {
  return level.points == Points::surface && level.iterations == 1 && level.loss == Loss::distance;
}

/// Whether its stages' Gauss-Newton matrices may be added to other stages'.
bool adds_up(const Level& level) { return regresses(level) && level.reweight == 0; }

/// The numbers of the factors whose centres differ.
std::vector<std::size_t> moved_between(const Map& before, const Map& after) {
  std::vector<std::size_t> moved;
  for (std::size_t k = 0; k < before.dynamics.factors.size(); ++k) {
    if (norm(after.dynamics.factors[k].center - before.dynamics.factors[k].center) > 0)
      moved.push_back(k);
  }
  return moved;
}

/// Gives the evaluations in `state.evaluated` first. Then it evaluates, reports to the observer,
/// adds to them, and saves the state whenever that is due.
Evaluate recorded(Evaluator& evaluator, const FitObserver& observer, FitState& state,
                  Checkpoint& checkpoint) {
  return [&, given = std::size_t{0}](const Map& map) mutable {
    if (given < state.evaluated.size()) return state.evaluated[given++];
    Evaluation evaluation = evaluator.evaluate(map, true);
    if (observer.on_evaluation) observer.on_evaluation(evaluation.energy);
    state.evaluated.push_back(evaluation);
    ++given;
    if (checkpoint.due()) checkpoint.save(state);
    return evaluation;
  };
}

}  // namespace

Stages::Stages(const Problem& problem, Map start, FitPlan plan)
    : problem_(problem),
      map_(std::move(start)),
      options_(std::move(plan.options)),
      schedule_(std::move(plan.schedule)),
      budget_(std::move(plan.budget)),
      checkpoint_(std::move(plan.checkpoint)),
      monitor_(std::move(plan.monitor)),
      most_triangles_(plan.most_triangles),
      random_(options_.seed) {}

void Stages::resume(FitState state) {
  map_ = state.map;
  finished_.reset();
  random_.set_state(state.random);
  reports_ = state.reports;
  curvature_ = state.curvature;
  budget_.carry(state.evaluations, state.seconds);
  resumed_ = std::move(state);
}

FitState Stages::next_state() const {
  if (resumed_) return *resumed_;
  const int level = std::max(level_, level_at(schedule_, budget_.fraction()));
  return {map_,
          random_.state(),
          level,
          budget_.most_evaluations(),
          budget_.evaluations(),
          budget_.seconds(),
          reports_,
          curvature_,
          {},
          most_triangles_};
}

FinishedMap Stages::finished() const {
  FinishedMap result = finished_ ? *finished_ : problem_.finished(map_);
  result.warnings.insert(result.warnings.begin(), warnings_.begin(), warnings_.end());
  return result;
}

void Stages::finish() {
  FinishedMap result = finished();
  finished_.reset();
  map_ = std::move(result.map);
  map_.layers.steepness = 1;  // a map has no steepness while it is fitted
  warnings_ = std::move(result.warnings);
}

std::optional<StopReason> Stages::step() {
  if (stopped_) return stopped_;
  budget_.update();
  stopped_ = budget_.spent();
  if (stopped_ == StopReason::interrupted) checkpoint_.save(next_state());
  // A stage that could not take a step would only overrun the limit.
  if (!stopped_ && budget_.time_left() < preparation_) stopped_ = StopReason::time_limit;
  if (!stopped_) {
    try {
      stopped_ = run_stage();
    } catch (const Interrupted&) {  // while it drew samples; its start is kept
      stopped_ = StopReason::interrupted;
    }
  }
  if (stopped_) lift_misplaced();
  return stopped_;
}

StopReason Stages::run() {
  while (!step()) {
  }
  return *stopped_;
}

void Stages::end() {
  if (stopped_) return;
  budget_.update();
  checkpoint_.save(next_state());
  stopped_ = StopReason::interrupted;
  lift_misplaced();
}

MisplacedFactors Stages::misplaced(const Level& level) {
  if (!regresses(level)) return {};
  return misplaced_factors(map_, problem_.distances(points_at_centers(map_)), level);
}

Map Stages::relocated(Evaluator& evaluator, const Samples& samples, int count) {
  try {
    return relocate_factors(evaluator, samples, map_, count, random_);
  } catch (const DeviceError& error) {
    if (!device::is_out_of_memory(error)) throw;
    return map_;
  }
}

void Stages::lift_misplaced() {
  constexpr int kMostTries = 3;        // a lift changes F at the others' samples
  constexpr double kMostLost = 0.001;  // IoU
  if (reports_.empty() || reports_.back().iterations > 1) return;
  if (options_.unknowns != Unknowns::all) return;
  const auto first_iterate = [](const Level& level) { return level.iterations == 1; };
  const Level& level =
      *std::ranges::find_if(schedule_.levels.rbegin(), schedule_.levels.rend(), first_iterate);
  const TraceStage traced(monitor_.trace, "lift misplaced");
  double least = reports_.back().iou - kMostLost;
  if (is_at_target()) least = std::max(least, *options_.target_iou);
  for (int i = 0; i < kMostTries; ++i) {
    const MisplacedFactors found = misplaced(level);
    if (found.factors.empty()) return;
    auto map = lifted(map_, found, evaluator_of(found.samples, level)->field(map_));
    if (!map) return;
    FinishedMap finished = problem_.finished(*map);
    const double overlap = problem_.overlap(finished.map, level.iterations);
    if (overlap < least) return;
    map_ = std::move(*map);
    finished_ = std::move(finished);
    reports_.back().iou = overlap;
    budget_.update();
    if (budget_.spent() == StopReason::time_limit) return;
  }
}

std::unique_ptr<Evaluator> Stages::evaluator_of(const Samples& samples, const Level& level) const {
  return problem_.evaluator(
      samples, {.loss = level.loss, .iterations = level.iterations, .alpha = level.alpha});
}

std::unique_ptr<Preconditioner> Stages::preconditioner(Evaluator& evaluator,
                                                       const Subspace& subspace, const Level& level,
                                                       const std::vector<std::size_t>& moved) {
  const double damping = schedule_.damping;
  if (!subspace.is_whole() || !adds_up(level)) curvature_ = {};
  try {
    if (subspace.is_whole()) {
      const NeighbourBlocks blocks = neighbour_blocks(map_, kFactorsOfBlock);
      BlockCurvature found = evaluator.gauss_newton_blocks(map_, blocks);
      if (!adds_up(level)) return preconditioner_of(found, damping);
      curvature_.add(std::move(found), moved);
      return preconditioner_of(curvature_.mean(), damping);
    }
    if (map_.dynamics.factors.size() <= kMostByMatrix) {
      return preconditioner_of(
          factorised(subspace.restricted_matrix(evaluator.gauss_newton(map_)), damping));
    }
  } catch (const DeviceError& error) {
    if (!device::is_out_of_memory(error)) throw;
    curvature_ = {};
  }
  return preconditioner_of_diagonal(
      subspace.restricted_diagonal(evaluator.gauss_newton_diagonal(map_)), damping);
}

Samples Stages::drawn(const Level& level) {
  Samples samples = problem_.draw(level, random_);
  if (level.loss == Loss::tanh) std::ranges::fill(samples.target, map_.dynamics.surface_level);
  if (level.reweight > 0) reweight(samples, evaluator_of(samples, level)->field(map_), level);
  return samples;
}

std::vector<std::size_t> Stages::relocate(Evaluator& evaluator, const Samples& samples,
                                          const Level& level) {
  const std::size_t factors = map_.dynamics.factors.size();
  const bool relocates = level.relocated > 0 && !reports_.empty() &&
                         options_.unknowns == Unknowns::all && factors <= kMostByMatrix;
  Map start = map_;
  std::vector<std::size_t> moved;
  if (relocates) {
    const TraceStage traced(monitor_.trace, "relocate");
    start = relocated(evaluator, samples, std::min(level.relocated, static_cast<int>(factors / 4)));
    moved = moved_between(map_, start);
  }
  map_ = problem_.agreed(std::move(start));
  finished_.reset();
  return moved;
}

Stages::Ready Stages::prepared(const Level& level) {
  const auto part = [&](const char* name, const auto& work) {
    const TraceStage traced(monitor_.trace, name);
    return work();
  };
  if (level.iterations > 1) {
    lift_misplaced();
    finish();
  }
  Samples samples = part("draw samples", [&] { return drawn(level); });
  auto evaluator = part("send samples", [&] { return evaluator_of(samples, level); });
  const std::vector<std::size_t> moved = relocate(*evaluator, samples, level);
  const Subspace subspace(map_, level, options_.unknowns);
  auto scaling =
      part("preconditioner", [&] { return preconditioner(*evaluator, subspace, level, moved); });
  if (const Samples centers = misplaced(level).samples; centers.size() > 0) {
    for (std::size_t i = 0; i < centers.size(); ++i) samples.add(centers, i);
    evaluator.reset();
    evaluator = part("send samples", [&] { return evaluator_of(samples, level); });
  }
  return {std::move(evaluator), subspace, std::move(scaling)};
}

MinimizeResult Stages::minimized(const Ready& ready, const Level& level, FitState& state) {
  const TraceStage traced(monitor_.trace, "minimise");
  const Evaluate evaluate = recorded(*ready.evaluator, options_.observer, state, checkpoint_);
  try {
    MinimizeResult result =
        minimize(evaluate, map_, ready.subspace, *ready.scaling, level.steps, budget_);
    if (result.stopped == StopReason::interrupted) checkpoint_.save(state);
    return result;
  } catch (const DeviceError&) {
    checkpoint_.save(state);  // another run need not evaluate again what this one has
    throw;
  }
}

StageReport Stages::report(const Level& level, const MinimizeResult& result,
                           const FitState& before) {
  const auto part = [&](const char* name, const auto& work) {
    const TraceStage traced(monitor_.trace, name);
    return work();
  };
  finished_ = part("finish", [&] { return problem_.finished(map_); });
  const double overlap =
      part("overlap", [&] { return problem_.overlap(finished_->map, level.iterations); });
  budget_.update();
  return {level.name,          budget_.evaluations() - before.evaluations, result.energy_before,
          result.energy_after, budget_.seconds() - before.seconds,         overlap,
          level.iterations};
}

std::optional<StopReason> Stages::run_stage() {
  FitState before = next_state();
  resumed_.reset();
  checkpoint_.save(before);
  level_ = before.level;
  const Level& level = schedule_.levels.at(static_cast<std::size_t>(before.level));
  const TraceStage stage(monitor_.trace, level.name);
  budget_.update();
  const double began = budget_.seconds();
  const Ready ready = prepared(level);
  budget_.update();
  preparation_ = budget_.seconds() - began;
  MinimizeResult result = minimized(ready, level, before);
  map_ = std::move(result.map);
  reports_.push_back(report(level, result, before));
  const StageReport& done = reports_.back();
  monitor_.report(
      {"fitting", budget_.fraction(), budget_.seconds_left(),
       fmt::format("IoU {:.4f}, {}, {} evaluations", done.iou, level.name, budget_.evaluations())});
  if (options_.observer.on_stage) options_.observer.on_stage(done, finished_->map);
  if (result.stopped) return result.stopped;
  const bool is_last_kind = level.iterations == schedule_.levels.back().iterations;
  if (is_last_kind && is_at_target()) return StopReason::target_iou;
  if (!converged(level, result)) return std::nullopt;
  if (++level_ == static_cast<int>(schedule_.levels.size())) return StopReason::converged;
  return std::nullopt;
}

}  // namespace qjulia::fitting
