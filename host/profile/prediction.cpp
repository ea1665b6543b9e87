#include "profile/prediction.hpp"

#include <algorithm>

#include "profile/instruction_counts.hpp"

namespace qjulia::profiling {

std::optional<double> predicted_seconds(const KernelFigures& f, const DeviceLimits& limits) {
  if (f.precision == Precision::dbl) return std::nullopt;
  const int before = f.iterations - 1;
  int slots_a_pair = 0;
  if (f.kernel == "energy") {
    slots_a_pair = before * slots(kStep) + slots(kLogNorm);
  } else if (f.kernel == "gradient" && f.iterations == 1) {
    slots_a_pair = slots(kLogNorm) + slots(kPotentialGradient);
  } else if (f.kernel == "gradient") {
    slots_a_pair =
        before * (slots(kStep) + slots(kPullBack)) + slots(kLogNorm) + slots(kPullBackLast);
  } else {
    return std::nullopt;
  }
  const double pairs = static_cast<double>(f.samples) * static_cast<double>(f.factors);
  return std::max(pairs * slots_a_pair / limits.fma_per_second,
                  f.memory_bytes.value_or(0) / limits.bytes_per_second);
}

}  // namespace qjulia::profiling
