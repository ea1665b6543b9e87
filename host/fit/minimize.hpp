#pragma once
/// One run of L-BFGS on a map's energy.

#include <cstddef>
#include <optional>
#include <vector>

#include "fit/budget.hpp"
#include "fit/evaluator.hpp"
#include "fit/preconditioner.hpp"

namespace qjulia {

struct MinimizeResult {
  RationalMap map;  ///< the best met
  double energy_before = 0;
  double energy_after = 0;
  std::optional<StopReason> stopped;  ///< set when the budget ended it
};

/// Minimises the energy over the unknowns `active` (indices as `to_unknowns` orders them), scaled
/// by the preconditioner, for at most `iterations` steps.
MinimizeResult minimize(Evaluator& evaluator, const RationalMap& start,
                        const std::vector<std::size_t>& active, const Preconditioner& scaling,
                        int iterations, Budget& budget);

}  // namespace qjulia
