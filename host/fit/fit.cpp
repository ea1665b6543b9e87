#include "qjulia/fit/fit.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/range_check.hpp"
#include "fit/factor_count.hpp"
#include "fit/fit_run.hpp"
#include "fit/schedule.hpp"
#include "fit/team.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/fit/fit_settings.hpp"

namespace qjulia {

using namespace fitting;
namespace {

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

}  // namespace

void FitOptions::validate() const {
  expect_in_ranges(fit_settings(), *this);
  if (max_factors && factors) {
    throw OptionError("max_factors",
                      fmt::format("it bounds the number that 'auto' chooses, and {} factors are "
                                  "asked for; leave out one of the two",
                                  *factors));
  }
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
        "IoU {:.3f} at n = {} on a grid of {} cells, mean distance {:.3g} % of the diagonal\n",
        last.iou, last.iterations, kOverlapCells, 100 * result.mean_distance);
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

struct Fit::Impl {
  Team alone{};
  FitRun run;

  Impl(const Device& device, const TriangleMesh& mesh, const FitOptions& options,
       const ProgressMonitor& monitor)
      : run(alone, device, mesh, options, monitor) {}
};

Fit::Fit(const Device& device, const TriangleMesh& mesh, const FitOptions& options,
         const ProgressMonitor& monitor)
    : impl_(std::make_unique<Impl>(device, mesh, options, monitor)) {}

Fit::~Fit() = default;
Fit::Fit(Fit&&) noexcept = default;
Fit& Fit::operator=(Fit&&) noexcept = default;

std::optional<StageReport> Fit::step() {
  const std::size_t before = stages().size();
  impl_->run.stages().step();
  if (stages().size() == before) return std::nullopt;
  return stages().back();
}

std::optional<StopReason> Fit::stopped() const { return impl_->run.stages().stopped(); }

const std::vector<StageReport>& Fit::stages() const { return impl_->run.stages().reports(); }

Map Fit::map() const { return impl_->run.map(); }

FitResult Fit::result() {
  impl_->run.stages().end();
  return impl_->run.result();
}

FitResult fit(const Device& device, const TriangleMesh& mesh, const FitOptions& options,
              const ProgressMonitor& monitor) {
  Team alone;
  return FitRun(alone, device, mesh, options, monitor).whole();
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
    own.time_limit = team.broadcast({options.most_seconds()}).front();
    return FitRun(team, device, mesh, own, mine).whole();
  });
}

}  // namespace qjulia
