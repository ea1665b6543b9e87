#include "fit/factor_count.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "fit/placement.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::fitting {
namespace {

constexpr int kFewest = 64;       // factors, where their number is chosen here
constexpr int kGrain = 16;        // its steps: maps are padded to as many
constexpr int kProbe = 320;       // factors that stages are timed with, where they find room
constexpr int kTimes = 3;         // that each of a stage's parts is timed
constexpr double kLine = 1.1;     // evaluations to a step of L-BFGS
constexpr double kLeastTime = 4;  // seconds: with less, timing would take too much of it

/// Seconds of a stage's parts.
struct StageTime {
  double curvature = 0;   ///< the blocks of JᵀWJ and their Cholesky factors
  double evaluation = 0;  ///< one of energy and gradient
};

/// The least of several times, since other work on the machine only adds to them.
template <class Work>
double least_seconds_of(const Work& work, Budget& budget) {
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kTimes; ++i) {
    budget.update();
    const double start = budget.seconds();
    work();
    budget.update();
    least = std::min(least, budget.seconds() - start);
  }
  return least;
}

/// With so many factors; kernels are built before anything is timed.
StageTime timed(const EvaluatorFactory& make_evaluator, const SamplePool& pool, const Level& level,
                int factors, std::uint64_t seed, Budget& budget) {
  const Map map = place_factors(make_evaluator, pool, factors, seed);
  base::Random random(seed);
  const auto evaluator = make_evaluator(pool.draw(level, random), {});
  constexpr double kDamping = 0.1;
  const NeighbourBlocks blocks = neighbour_blocks(map, kFactorsOfBlock);
  const auto precondition = [&] {
    preconditioner_of(evaluator->gauss_newton_blocks(map, blocks), kDamping);
  };
  const auto evaluate = [&] { evaluator->evaluate(map, true); };
  precondition();
  evaluate();
  return {least_seconds_of(precondition, budget), least_seconds_of(evaluate, budget)};
}

/// @param probe a stage's time with `probed` factors.
double stage_seconds(const StageTime& probe, double probed, double factors, const Level& level) {
  const auto samples = [](double count) {
    return static_cast<double>(curvature_samples(1 + 5 * static_cast<std::size_t>(count)));
  };
  return factors / probed *
         (probe.curvature * samples(factors) / samples(probed) +
          probe.evaluation * kLine * level.steps);
}

bool follows_time(const FitOptions& options, const Schedule& schedule) {
  return std::isfinite(options.most_seconds()) && schedule.automatic.stages > 0;
}

}  // namespace

int planned_evaluations(const FitOptions& options, const Schedule& schedule) {
  if (options.max_evaluations) return *options.max_evaluations;
  const bool own = options.factors || follows_time(options, schedule);
  return own || schedule.automatic.evaluations == 0 ? schedule.evaluations
                                                    : schedule.automatic.evaluations;
}

int chosen_factors(const FitOptions& options, const Schedule& schedule,
                   const EvaluatorFactory& make_evaluator, const SamplePool& pool, Budget& budget) {
  if (options.factors) return *options.factors;
  const AutomaticFactors& automatic = schedule.automatic;
  const int places = most_factors(pool);
  if (places < kLeastFactors) {
    throw InputError(fmt::format(
        "the mesh has room for only {} factors, but a map needs at least {}; check that "
        "it encloses a volume and has no small part far from the rest",
        places, kLeastFactors));
  }
  const int most = std::min(options.max_factors.value_or(kMostChosenFactors), places);
  const Level& level = schedule.levels.front();
  const int evaluations = planned_evaluations(options, schedule);
  int factors = automatic.factors;
  if (evaluations < automatic.evaluations) {  // few evaluations settle few factors
    const double share = static_cast<double>(evaluations) / automatic.evaluations;
    factors = std::min(factors, std::max(kFewest, static_cast<int>(factors * share)));
  }
  if (follows_time(options, schedule)) {
    factors = kFewest;
    budget.update();
    if (most > kFewest && budget.time_left() > kLeastTime) {
      const int probed = std::min(kProbe, most);
      const StageTime probe = timed(make_evaluator, pool, level, probed, options.seed, budget);
      budget.update();
      const double time = budget.time_left() / automatic.stages;
      while (factors + kGrain <= most &&
             stage_seconds(probe, probed, factors + kGrain, level) <= time) {
        factors += kGrain;
      }
    }
  }
  return std::min(factors, most);
}

}  // namespace qjulia::fitting
