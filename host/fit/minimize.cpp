#include "fit/minimize.hpp"

#include <LBFGS.h>

#include <limits>

#include "fit/lbfgs.hpp"

namespace qjulia::fitting {
namespace {

/// Ends a run of the solver from inside the function it minimises.
struct Ended {
  std::optional<StopReason> reason;  ///< why the whole fit ends, if it does
};

/// The energy by the step u, scaled so that the solver's first trial step, of length one along the
/// gradient, is Newton's: with c = 1 / |g|² the energy is cE and u is √c times longer.
class ScaledEnergy {
 public:
  ScaledEnergy(const Evaluate& evaluate, const Map& start, const Subspace& subspace,
               const Preconditioner& scaling, int most_evaluations, Budget& budget)
      : evaluate_(evaluate),
        start_(start),
        origin_(to_unknowns(start)),
        subspace_(subspace),
        scaling_(scaling),
        evaluations_left_(most_evaluations),
        budget_(budget),
        best_(start) {}

  double operator()(const Eigen::VectorXd& step, Eigen::VectorXd& gradient) {
    if (!first_) {
      budget_.update();
      if (const auto reason = budget_.spent()) throw Ended{reason};
    }
    if (evaluations_left_-- == 0) throw Ended{};
    const Eigen::VectorXd move = subspace_.prolonged(scaling_.move(step / stretch_));
    auto unknowns = origin_;
    for (std::size_t i = 0; i < unknowns.size(); ++i) {
      unknowns[i] += move[static_cast<Eigen::Index>(i)];
    }
    const Map map = with_unknowns(start_, unknowns);
    const Evaluation evaluation = evaluate_(map);
    budget_.count_evaluation();
    if (evaluation.energy < best_energy_) {
      best_energy_ = evaluation.energy;
      best_ = map;
    }
    gradient = scaling_.gradient(subspace_.restricted_gradient(Eigen::Map<const Eigen::VectorXd>(
        evaluation.gradient.data(), static_cast<Eigen::Index>(evaluation.gradient.size()))));
    if (first_) {
      first_ = false;
      energy_before_ = evaluation.energy;
      const double length = gradient.norm();
      stretch_ = length > 0 ? 1 / length : 1;
    }
    gradient *= stretch_;
    return evaluation.energy * stretch_ * stretch_;
  }

  MinimizeResult result(std::optional<StopReason> stopped) const {
    return {best_, energy_before_, best_energy_, stopped};
  }

 private:
  const Evaluate& evaluate_;
  const Map& start_;
  std::vector<double> origin_;
  const Subspace& subspace_;
  const Preconditioner& scaling_;
  int evaluations_left_;
  Budget& budget_;
  bool first_ = true;
  double stretch_ = 1;
  double energy_before_ = 0;
  double best_energy_ = std::numeric_limits<double>::infinity();
  Map best_;
};

}  // namespace

MinimizeResult minimize(const Evaluate& evaluate, const Map& start, const Subspace& subspace,
                        const Preconditioner& scaling, int iterations, Budget& budget) {
  LBFGSpp::LBFGSParam<double> parameters;
  parameters.m = 20;
  // Moves are rounded to single precision: a gradient that has shrunk this much is noise.
  parameters.epsilon = 1e-6;
  parameters.epsilon_rel = 0;
  parameters.max_iterations = iterations;
  parameters.linesearch = LBFGSpp::LBFGS_LINESEARCH_BACKTRACKING_STRONG_WOLFE;
  LBFGSpp::LBFGSSolver<double, LBFGSpp::LineSearchNocedalWright> solver(parameters);

  // A step takes 1.1 of them. One that needs many gains next to nothing: rounding is in its way.
  const int most_evaluations = 2 * iterations + 10;
  ScaledEnergy energy(evaluate, start, subspace, scaling, most_evaluations, budget);
  Eigen::VectorXd step = Eigen::VectorXd::Zero(scaling.size());
  double value = 0;
  try {
    run_lbfgs(energy, [&](auto& objective) { solver.minimize(objective, step, value); });
  } catch (const Ended& ended) {
    return energy.result(ended.reason);
  }
  return energy.result(std::nullopt);
}

}  // namespace qjulia::fitting
