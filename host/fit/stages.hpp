#pragma once
/// The stages of one fit: a map whose F_1 comes ever closer to signed distance.

#include <functional>
#include <vector>

#include "fit/budget.hpp"
#include "fit/evaluator.hpp"
#include "fit/sample_pool.hpp"
#include "fit/schedule.hpp"

namespace qjulia {

class Stages {
 public:
  /// @param overlap IoU of a map with the shape, for reports.
  Stages(RationalMap start, const SamplePool& pool, EvaluatorFactory make_evaluator,
         std::function<double(const RationalMap&)> overlap, const FitOptions& options,
         const Schedule& schedule, Budget& budget, const Watch& watch);

  /// Runs stages until the budget is spent.
  StopReason run();

  const RationalMap& map() const { return map_; }
  const std::vector<StageReport>& reports() const { return reports_; }

 private:
  std::optional<StopReason> run_stage(const Phase& phase);

  RationalMap map_;
  const SamplePool& pool_;
  EvaluatorFactory make_evaluator_;
  std::function<double(const RationalMap&)> overlap_;
  const FitOptions& options_;
  const Schedule& schedule_;
  Budget& budget_;
  const Watch& watch_;
  Random random_;
  std::vector<StageReport> reports_;
};

}  // namespace qjulia
