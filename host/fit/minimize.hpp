#pragma once
/// One run of L-BFGS on a map's energy.

#include <functional>
#include <optional>

#include "fit/budget.hpp"
#include "fit/energy_names.hpp"
#include "fit/subspace.hpp"

namespace qjulia::fitting {

/// Energy and gradient of a map.
using Evaluate = std::function<Evaluation(const Map&)>;

struct MinimizeResult {
  Map map;  ///< the best met
  double energy_before = 0;
  double energy_after = 0;
  std::optional<StopReason> stopped;  ///< set when the budget ended it
};

/// Minimises the energy over the subspace's variables, scaled by the preconditioner, for at most
/// `iterations` steps.
MinimizeResult minimize(const Evaluate& evaluate, const Map& start, const Subspace& subspace,
                        const Preconditioner& scaling, int iterations, Budget& budget);

}  // namespace qjulia::fitting
