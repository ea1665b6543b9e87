#pragma once
/// The stages of one fit: a map whose F_1 comes ever closer to signed distance.

#include <functional>
#include <optional>
#include <vector>

#include "base/random.hpp"
#include "fit/budget.hpp"
#include "fit/checkpoint.hpp"
#include "fit/evaluator.hpp"
#include "fit/misplaced.hpp"
#include "fit/schedule.hpp"
#include "fit/subspace.hpp"

namespace qjulia::fitting {

class Stages {
 public:
  /// What stages ask about the shape.
  struct Target {
    /// A stage's samples.
    std::function<Samples(const Level&, base::Random&)> draw;
    /// IoU of a map's n-th iterate with the shape, for reports.
    std::function<double(const RationalMap&, int)> overlap;
    /// A map, with its IoU, given the wanted detail: in distance units, or polished since.
    std::function<RationalMap(const RationalMap&, double)> with_detail;
    /// Signed distances of points from its surface; without it misplaced factors are left alone.
    std::function<std::vector<double>(const std::vector<Eigen::Vector3d>&)> distances = {};
    /// Hears of each stage's end, with the map as it is fitted; may be empty.
    std::function<void(const StageReport&, const RationalMap&)> on_stage = {};
    /// The map that a stage starts from, one for all where several processes fit together.
    std::function<RationalMap(RationalMap)> agreed = std::identity{};
  };

  Stages(RationalMap start, Target target, EvaluatorFactory make_evaluator,
         const FitOptions& options, const Schedule& schedule, Budget& budget,
         Checkpoint& checkpoint, const ProgressMonitor& monitor);

  /// Goes on where an earlier process stood.
  void resume(FitState state);

  /// Runs stages until the budget is spent.
  StopReason run();

  /// With the wanted detail.
  RationalMap map() const;
  const std::vector<StageReport>& reports() const { return reports_; }

 private:
  std::optional<StopReason> run_stage();
  /// The state at the start of a stage.
  FitState next_state() const;
  /// The map's misplaced factors; none where the level has no use for them.
  MisplacedFactors misplaced(const Level& level);
  /// The map with `count` factors moved, as `relocate_factors` does; as it is if memory does not
  /// suffice.
  RationalMap relocated(Evaluator& evaluator, const Samples& samples, int count);
  /// Lifts misplaced factors off the slice where the stages of the first iterate end: the last of
  /// them may have moved a factor to where it makes a hole or a body.
  void lift_misplaced();
  std::unique_ptr<Evaluator> evaluator_of(const Samples& samples, const Level& level) const;
  /// Adds to `curvature_` what the stages before a resumed one had added.
  void gather_curvature();
  void forget_curvature();
  Preconditioner preconditioner(Evaluator& evaluator, const Subspace& subspace,
                                const CurvatureSource& source);

  RationalMap map_;
  Target target_;
  EvaluatorFactory make_evaluator_;
  const FitOptions& options_;
  const Schedule& schedule_;
  Budget& budget_;
  Checkpoint& checkpoint_;
  ProgressMonitor monitor_;
  base::Random random_;
  std::vector<StageReport> reports_;
  std::vector<CurvatureSource> sources_;  ///< of `curvature_`
  CurvatureSum curvature_;
  double preparation_ = 0;           ///< seconds of the last stage before its first step
  int level_ = 0;                    ///< no stage belongs to an earlier one any more
  std::optional<FitState> resumed_;  ///< the stage that was under way, until it is run
};

}  // namespace qjulia::fitting
