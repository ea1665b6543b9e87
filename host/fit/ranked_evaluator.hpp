#pragma once
/// One fit's energy over the samples of many ranks.

#include "fit/evaluator.hpp"
#include "qjulia/ranks.hpp"

namespace qjulia {

/// Samples in equal parts, part p on rank p mod size, each with an evaluator of its own. Energies
/// and gradients are summed by part, in the parts' order: the same bits for the same parts, however
/// many ranks they lie on. Rank 0 makes one for a fit; the others call `serve_evaluations`, and
/// what rank 0 asks its evaluators, all of them answer.
class RankedEvaluators {
 public:
  /// @param local makes the parts' evaluators. @param parts at least 1.
  RankedEvaluators(Ranks& ranks, EvaluatorFactory local, int parts);
  /// Lets the other ranks go.
  ~RankedEvaluators();
  RankedEvaluators(const RankedEvaluators&) = delete;
  RankedEvaluators& operator=(const RankedEvaluators&) = delete;

  /// Evaluators that live no longer than this.
  EvaluatorFactory factory();

 private:
  Ranks& ranks_;
  EvaluatorFactory local_;
  int parts_;
  double next_ = 0;  ///< number of the next evaluator
};

/// What ranks other than 0 do during a fit: evaluate what rank 0 asks for, until it ends.
void serve_evaluations(Ranks& ranks, const EvaluatorFactory& local);

}  // namespace qjulia
