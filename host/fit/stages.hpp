#pragma once
/// The stages of one fit: a map whose F_1 comes ever closer to signed distance.

#include <limits>
#include <optional>
#include <vector>

#include "base/random.hpp"
#include "fit/budget.hpp"
#include "fit/checkpoint.hpp"
#include "fit/energy_names.hpp"
#include "fit/minimize.hpp"
#include "fit/misplaced.hpp"
#include "fit/problem.hpp"
#include "fit/schedule.hpp"
#include "fit/subspace.hpp"

namespace qjulia::fitting {

/// How a fit goes, what it may spend, and where it is kept.
struct FitPlan {
  FitOptions options;
  Schedule schedule;
  Budget budget;
  Checkpoint checkpoint;
  ProgressMonitor monitor{};
  /// The mesh is measured with at most so many triangles.
  double most_triangles = std::numeric_limits<double>::infinity();
};

/// A fit that is taken step by step. Each step is a stage.
class Stages {
 public:
  Stages(const Problem& problem, Map start, FitPlan plan);

  /// Goes on where an earlier process stood.
  void resume(FitState state);

  /// Runs a stage, unless the budget is spent.
  /// @return why the fit has ended; nothing while there are further stages.
  std::optional<StopReason> step();
  /// Takes steps until the fit has ended.
  StopReason run();
  /// Ends the fit as a stop request does, unless it has ended.
  void end();
  /// Why it has ended; nothing while there are further stages.
  std::optional<StopReason> stopped() const { return stopped_; }

  /// What the fit would give if it ended here, with all warnings so far.
  FinishedMap finished() const;
  const std::vector<StageReport>& reports() const { return reports_; }
  Budget& budget() { return budget_; }
  const Checkpoint& checkpoint() const { return checkpoint_; }

 private:
  /// What a stage minimises, in which variables, and how these are scaled.
  struct Ready {
    std::unique_ptr<Evaluator> evaluator;
    Subspace subspace;
    std::unique_ptr<Preconditioner> scaling;
  };

  std::optional<StopReason> run_stage();
  /// The first phase of a stage: draws its samples and moves the map to where it starts.
  Ready prepared(const Level& level);
  /// The second. Each evaluation is added to `state`, which the checkpoint keeps.
  MinimizeResult minimized(const Ready& ready, const Level& level, FitState& state);
  /// The third: finishes and measures the map. @param before where the fit stood.
  StageReport report(const Level& level, const MinimizeResult& result, const FitState& before);

  /// A stage's samples, with the weights that its level wants.
  Samples drawn(const Level& level);
  /// Moves factors where the level wants that. @return the numbers of those that were moved.
  std::vector<std::size_t> relocate(Evaluator& evaluator, const Samples& samples,
                                    const Level& level);
  /// Whether the last stage's IoU is the one asked for, or more.
  bool is_at_target() const {
    return options_.target_iou && !reports_.empty() && reports_.back().iou >= *options_.target_iou;
  }
  /// Gives the map the wanted detail, before the stages of the second iterate begin.
  void finish();
  /// The state at the start of a stage.
  FitState next_state() const;
  /// The map's misplaced factors; none where the level has no use for them.
  MisplacedFactors misplaced(const Level& level);
  /// The map with `count` factors moved, as `relocate_factors` does; as it is if memory does not
  /// suffice.
  Map relocated(Evaluator& evaluator, const Samples& samples, int count);
  /// Lifts misplaced factors off the slice where the stages of the first iterate end: the last of
  /// them may have moved a factor to where it makes a hole or a body.
  void lift_misplaced();
  std::unique_ptr<Evaluator> evaluator_of(const Samples& samples, const Level& level) const;
  /// @param moved the numbers of the factors that were relocated before this stage.
  std::unique_ptr<Preconditioner> preconditioner(Evaluator& evaluator, const Subspace& subspace,
                                                 const Level& level,
                                                 const std::vector<std::size_t>& moved);

  const Problem& problem_;
  Map map_;
  std::optional<FinishedMap> finished_;  ///< of `map_`, once it is known
  FitOptions options_;
  Schedule schedule_;
  Budget budget_;
  Checkpoint checkpoint_;
  ProgressMonitor monitor_;
  double most_triangles_;
  base::Random random_;
  std::vector<StageReport> reports_;
  std::vector<std::string> warnings_;  ///< about maps that were finished to be polished
  std::optional<StopReason> stopped_;
  CurvatureSum curvature_;           ///< of the stages whose matrices add up
  double preparation_ = 0;           ///< seconds of the last stage before its first step
  int level_ = 0;                    ///< no stage belongs to an earlier one any more
  std::optional<FitState> resumed_;  ///< the stage that was under way, until it is run
};

}  // namespace qjulia::fitting
