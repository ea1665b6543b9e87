#include "fit/stages.hpp"

#include <fmt/format.h>

#include <numeric>

#include "fit/minimize.hpp"
#include "fit/relocate.hpp"

namespace qjulia {
namespace {

std::vector<std::size_t> active_unknowns(Unknowns unknowns, std::size_t factors) {
  std::vector<std::size_t> active(unknowns == Unknowns::all ? 1 + 5 * factors : 1 + factors);
  std::iota(active.begin(), active.end(), 0U);
  return active;
}

int phase_at(const Schedule& schedule, double fraction) {
  const auto last = static_cast<int>(schedule.phases.size()) - 1;
  for (int i = 0; i < last; ++i) {
    if (fraction < schedule.phases[static_cast<std::size_t>(i)].until) return i;
  }
  return last;
}

}  // namespace

Stages::Stages(RationalMap start, const SamplePool& pool, EvaluatorFactory make_evaluator,
               std::function<double(const RationalMap&)> overlap, const FitOptions& options,
               const Schedule& schedule, Budget& budget, Checkpoint& checkpoint, const Watch& watch)
    : map_(std::move(start)),
      pool_(pool),
      make_evaluator_(std::move(make_evaluator)),
      overlap_(std::move(overlap)),
      options_(options),
      schedule_(schedule),
      budget_(budget),
      checkpoint_(checkpoint),
      watch_(watch),
      random_(options.seed) {}

void Stages::resume(FitState state) {
  map_ = state.map;
  random_.set_state(state.random);
  reports_ = state.reports;
  budget_.carry(state.evaluations, state.seconds);
  resumed_ = std::move(state);
}

FitState Stages::state(int phase) const {
  return {map_, random_.state(), phase, budget_.evaluations(), budget_.seconds(), reports_, {}};
}

StopReason Stages::run() {
  for (;;) {
    if (const auto reason = budget_.spent()) return *reason;
    if (const auto reason = run_stage()) return *reason;
  }
}

std::optional<StopReason> Stages::run_stage() {
  FitState before =
      resumed_ ? std::move(*resumed_) : state(phase_at(schedule_, budget_.fraction()));
  resumed_.reset();
  checkpoint_.save(before);
  const Phase& phase = schedule_.phases.at(static_cast<std::size_t>(before.phase));
  const TraceStage stage(watch_.trace, phase.name);
  const double start = budget_.seconds();
  const int evaluations = budget_.evaluations();
  const auto part = [&](const char* name, const auto& work) {
    const TraceStage traced(watch_.trace, name);
    return work();
  };
  const Samples samples = part("draw samples", [&] { return pool_.draw(phase, random_); });
  const auto evaluator = part("send samples", [&] { return make_evaluator_(samples, {}); });
  if (phase.relocated > 0 && !reports_.empty() && options_.unknowns == Unknowns::all) {
    const auto most = static_cast<int>(map_.factors.size() / 4);
    map_ = part("relocate", [&] {
      return relocate_factors(*evaluator, samples, map_, std::min(phase.relocated, most), random_);
    });
  }
  const auto active = active_unknowns(options_.unknowns, map_.factors.size());
  const Preconditioner scaling = part("preconditioner", [&] {
    return Preconditioner(evaluator->gauss_newton(map_), active, schedule_.damping);
  });
  RecordingEvaluator recorded(*evaluator, before, checkpoint_);
  auto result = part("minimise", [&] {
    return minimize(recorded, map_, active, scaling, phase.iterations, budget_);
  });
  map_ = std::move(result.map);
  const double overlap = part("overlap", [&] { return overlap_(map_); });
  reports_.push_back({phase.name, budget_.evaluations() - evaluations, result.energy_before,
                      result.energy_after, budget_.seconds() - start, overlap});
  watch_.report({"fitting", budget_.fraction(), budget_.seconds_left(),
                 fmt::format("{}, {} evaluations, energy {:.3e}, IoU {:.4f}", phase.name,
                             budget_.evaluations(), result.energy_after, reports_.back().iou)});
  return result.stopped;
}

}  // namespace qjulia
