#include "profile/roof.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace qjulia::profiling {

Roof roof_of(const KernelWork& work, const Spent& spent, const Roofs& roofs) {
  const double rate = work.is_double ? roofs.double_fma_per_second : roofs.fma_per_second;
  const double cpu_rate =
      work.is_double ? roofs.double_fma_per_cpu_second : roofs.fma_per_cpu_second;
  const bool has_cpu = spent.cpu_seconds > 0 && cpu_rate > 0 && roofs.bytes_per_cpu_second > 0;
  const auto time_at = [](double amount, double per_second) {
    return amount > 0 && per_second > 0 ? amount / per_second : 0;
  };
  const double by_fma = time_at(work.slots, has_cpu ? cpu_rate : rate);
  const double by_memory =
      time_at(work.bytes, has_cpu ? roofs.bytes_per_cpu_second : roofs.bytes_per_second);
  if (!(spent.seconds > 0) || (by_fma == 0 && by_memory == 0)) return {};
  if (by_fma >= by_memory) {
    return {"fma", by_fma / (has_cpu ? spent.cpu_seconds : spent.seconds)};
  }
  return {"memory", time_at(work.bytes, roofs.bytes_per_second) / spent.seconds};
}

JudgedShare judged(const std::string& limit, bool is_at_most, const std::optional<Interval>& shares,
                   bool is_busy, const std::optional<double>& ceiling) {
  if (limit.empty() || !shares) return {};
  // A share is not judged if the ends of its interval differ by more than this factor.
  constexpr double kWidest = 1.25;
  const bool is_memory = limit == "memory";
  const bool is_wide = !(shares->high <= kWidest * shares->low);
  // Shares of an idle machine scatter by less; known ceilings say more.
  constexpr double kWidestBeside = 1.05;
  const bool is_changed = ceiling ? shares->middle < kAtCeiling * *ceiling
                                  : !(shares->high <= kWidestBeside * shares->low);
  if (is_wide || (is_busy && (is_memory || is_changed))) return {{}, {}, {}, "not now", limit};
  if (shares->low > 1) {
    return {{}, {}, {}, is_memory ? "cached" : is_at_most ? "ends early" : "not now", limit};
  }
  return {std::min(shares->middle, 1.0), shares->low, std::min(shares->high, 1.0), "judged", limit};
}

std::vector<std::string> signs_of_load(double fma_before, double fma_after,
                                       const std::optional<double>& waited_share) {
  std::vector<std::string> signs;
  if (waited_share && *waited_share > kUsualWait) {
    signs.push_back(fmt::format(
        "the threads that run kernels waited for a processor for {:.0f} % of their time",
        100 * *waited_share));
  }
  if (std::abs(fma_after / fma_before - 1) > kUsualDrift) {
    signs.push_back(fmt::format("the multiply-add limit was {:.1f} G/s before and {:.1f} after",
                                1e-9 * fma_before, 1e-9 * fma_after));
  }
  return signs;
}

}  // namespace qjulia::profiling
