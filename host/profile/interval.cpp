#include "profile/interval.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace qjulia::profiling {

Interval interval_of_median(std::vector<double> values) {
  std::ranges::sort(values);
  const std::size_t n = values.size();
  const double most = (1 - kIntervalConfidence) / 2;
  double chance = std::exp2(-static_cast<double>(n)), below = chance;  // of 0 values, of at most 0
  std::size_t k = 1;
  while (2 * (k + 1) <= n) {
    chance *= static_cast<double>(n + 1 - k) / static_cast<double>(k);
    below += chance;
    if (below > most) break;
    ++k;
  }
  const std::size_t half = n / 2;
  const double middle = n % 2 == 1 ? values[half] : std::sqrt(values[half - 1] * values[half]);
  return {values[k - 1], middle, values[n - k]};
}

}  // namespace qjulia::profiling
