#pragma once
/// The stages of one fit: a map whose F_1 comes ever closer to signed distance.

#include <functional>
#include <optional>
#include <vector>

#include "fit/budget.hpp"
#include "fit/checkpoint.hpp"
#include "fit/evaluator.hpp"
#include "fit/random.hpp"
#include "fit/schedule.hpp"

namespace qjulia {

class Stages {
 public:
  /// A stage's samples.
  using Draw = std::function<Samples(const Level&, Random&)>;

  /// @param overlap IoU of a map with the shape, for reports.
  Stages(RationalMap start, Draw draw, EvaluatorFactory make_evaluator,
         std::function<double(const RationalMap&)> overlap, const FitOptions& options,
         const Schedule& schedule, Budget& budget, Checkpoint& checkpoint, const Watch& watch);

  /// Goes on where an earlier process stood.
  void resume(FitState state);

  /// Runs stages until the budget is spent.
  StopReason run();

  const RationalMap& map() const { return map_; }
  const std::vector<StageReport>& reports() const { return reports_; }

 private:
  std::optional<StopReason> run_stage();
  /// The state at the start of a stage.
  FitState state(int level) const;

  RationalMap map_;
  Draw draw_;
  EvaluatorFactory make_evaluator_;
  std::function<double(const RationalMap&)> overlap_;
  const FitOptions& options_;
  const Schedule& schedule_;
  Budget& budget_;
  Checkpoint& checkpoint_;
  const Watch& watch_;
  Random random_;
  std::vector<StageReport> reports_;
  int level_ = 0;                    ///< no stage belongs to an earlier one any more
  std::optional<FitState> resumed_;  ///< the stage that was under way, until it is run
};

}  // namespace qjulia
