#include "profile/roof.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "profile/processor_watch.hpp"

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
                   bool is_busy, const std::optional<CodeBounds>& bounds) {
  if (limit.empty() || !shares) return {};
  // A share is not judged if the ends of its interval differ by more than this factor.
  constexpr double kWidest = 1.25;
  const bool is_memory = limit == "memory";
  const bool is_wide = !(shares->high <= kWidest * shares->low);
  // Shares of an idle machine scatter by less; known instructions say more.
  constexpr double kWidestBeside = 1.05;
  const bool is_changed =
      bounds ? shares->middle < kAtCeiling * bounds->ceiling && shares->middle > bounds->from_memory
             : !(shares->high <= kWidestBeside * shares->low);
  const auto not_now = [&](Doubt doubt) {
    JudgedShare seen{{}, {}, {}, "not now", limit, doubt};
    if (shares->low <= 1) seen.low = shares->low, seen.high = std::min(shares->high, 1.0);
    return seen;
  };
  if (is_busy && (is_memory || is_wide || is_changed)) return not_now(Doubt::other_programs);
  if (is_wide) return not_now(Doubt::spread);
  if (shares->low > 1) {
    if (!is_memory && !is_at_most) return not_now(Doubt::above_limit);
    return {{}, {}, {}, is_memory ? "cached" : "ends early", limit};
  }
  return {std::min(shares->middle, 1.0), shares->low, std::min(shares->high, 1.0), "judged", limit};
}

std::optional<double> JudgedShare::seen() const {
  if (share) return share;
  return low ? std::optional(std::sqrt(*low * *high)) : std::nullopt;
}

std::vector<std::string> signs_of_load(double fma_before, double fma_after,
                                       const std::optional<double>& waited_share,
                                       const std::optional<ProcessorUse>& use) {
  std::vector<std::string> signs;
  if (waited_share && *waited_share > kUsualWait) {
    const std::vector<std::string> others = use ? reasons(*use) : std::vector<std::string>();
    signs.push_back(fmt::format(
        "the threads that run kernels waited for a processor for {:.0f} % of their time{}",
        100 * *waited_share,
        others.empty() ? std::string() : fmt::format(" ({})", fmt::join(others, ", "))));
  }
  if (std::abs(fma_after / fma_before - 1) > kUsualDrift) {
    signs.push_back(fmt::format("the multiply-add limit was {:.1f} G/s before and {:.1f} after",
                                1e-9 * fma_before, 1e-9 * fma_after));
  }
  return signs;
}

}  // namespace qjulia::profiling
