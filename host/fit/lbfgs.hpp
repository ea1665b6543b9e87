#pragma once
/// Runs of LBFGSpp's solvers.

#include <exception>
#include <stdexcept>

namespace qjulia::fitting {

/// Calls `minimize` with an objective function for a solver. The solver throws where rounding ends
/// its line search: that ends the run, and the lowest point so far stands. What `objective` itself
/// throws is no business of the solver's and passes through.
template <class Objective, class Minimize>
void run_lbfgs(Objective& objective, const Minimize& minimize) {
  struct FromObjective {
    std::exception_ptr thrown;
  };
  auto guarded = [&objective](const auto& x, auto& gradient) {
    try {
      return objective(x, gradient);
    } catch (...) {
      throw FromObjective{std::current_exception()};
    }
  };
  try {
    minimize(guarded);
  } catch (const FromObjective& failure) {
    std::rethrow_exception(failure.thrown);
  } catch (const std::runtime_error&) {
    // The line search found no lower point in this precision.
  } catch (const std::logic_error&) {
    // The direction rose: rounding again.
  }
}

}  // namespace qjulia::fitting
