#pragma once
/// How many factors a fit has when its caller leaves that to it.

#include "fit/budget.hpp"
#include "fit/energy_names.hpp"
#include "fit/sample_pool.hpp"
#include "fit/schedule.hpp"

namespace qjulia::fitting {

constexpr int kLeastFactors = 8, kMostFactors = 20'000;
constexpr int kMostChosenFactors = 1500;  ///< unless FitOptions::max_factors says otherwise

/// Evaluations that a fit makes unless time ends it.
int planned_evaluations(const FitOptions& options, const Schedule& schedule);

/// The caller's number. If there is none and there is a time limit, it is the largest number for
/// which the schedule's number of stages fits into the time that is left; to find it, the parts of
/// a stage with few factors are timed by the budget's clock. Without a time limit it is the
/// schedule's own number, or fewer where few evaluations are asked for.
int chosen_factors(const FitOptions& options, const Schedule& schedule,
                   const EvaluatorFactory& make_evaluator, const SamplePool& pool, Budget& budget);

}  // namespace qjulia::fitting
