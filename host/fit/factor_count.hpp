#pragma once
/// How many factors a fit has when its caller leaves that to it.

#include "fit/budget.hpp"
#include "fit/evaluator.hpp"
#include "fit/sample_pool.hpp"
#include "fit/schedule.hpp"

namespace qjulia::fitting {

constexpr int kLeastFactors = 8;

/// Evaluations that a fit makes unless time ends it.
int planned_evaluations(const FitOptions& options, const Schedule& schedule);

/// The caller's number; or, with a time limit, the largest for which the schedule's number of
/// stages fits into the time that is left, by timing the parts of a stage with few factors by the
/// budget's clock; or the schedule's own, fewer where few evaluations are asked for.
int chosen_factors(const FitOptions& options, const Schedule& schedule,
                   const EvaluatorFactory& make_evaluator, const SamplePool& pool, Budget& budget);

}  // namespace qjulia::fitting
