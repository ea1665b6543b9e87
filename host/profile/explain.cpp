#include "profile/explain.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace qjulia::profiling {
namespace {

std::string counted(int number, const char* one) {
  return fmt::format("{} {}{}", number, one, number == 1 ? "" : "s");
}

/// What else there is in the loop.
std::string rest_of_loop(const InstructionMix& mix) {
  std::string text =
      fmt::format("a loop of {:.0f} % of its time, with {} and {}", 100 * mix.time_share,
                  counted(mix.loads, "load"), counted(mix.stores, "store"));
  return mix.spills > 0 ? text + fmt::format(", {} of them on the stack", mix.spills) : text;
}

std::string operations_text(const InstructionMix& mix) {
  return fmt::format("{} of {} are multiply-adds, multiplications or divisions", mix.slots(),
                     counted(mix.operations(), "vector operation"));
}

/// Multiply-adds that a device does while a cache gives it so many bytes, over those of the loop.
double data_ceiling(const InstructionMix& mix, double bytes_per_second, double fma_per_second,
                    double real_bytes) {
  if (mix.data_bytes == 0 || !(bytes_per_second > 0) || !(fma_per_second > 0)) return 1;
  const double fma_seconds = mix.slot_bytes / real_bytes / fma_per_second;
  return std::min(1.0, fma_seconds / (mix.data_bytes / bytes_per_second));
}

/// The multiply-adds of a precision, in CPU seconds where they are known.
struct FmaRate {
  double per_second, real_bytes;
  bool is_of_cpu;
  double of(const CacheRoof& cache) const {
    return is_of_cpu ? cache.bytes_per_cpu_second : cache.bytes_per_second;
  }
};
FmaRate fma_rate(const Roofs& roofs, bool is_double) {
  const double cpu = is_double ? roofs.double_fma_per_cpu_second : roofs.fma_per_cpu_second;
  const double all = is_double ? roofs.double_fma_per_second : roofs.fma_per_second;
  const bool has_cpu =
      cpu > 0 && !roofs.caches.empty() && roofs.caches.front().bytes_per_cpu_second > 0;
  return {has_cpu ? cpu : all, is_double ? 8.0 : 4.0, has_cpu};
}

/// "; data would allow it 100 % from L2, 37 % from L3"; empty where all of them allow all.
std::string data_text(const InstructionMix& mix, const Roofs& roofs, bool is_double) {
  const FmaRate rate = fma_rate(roofs, is_double);
  std::string text;
  bool is_any_short = false;
  const auto add = [&](const std::string& place, double bytes_per_second) {
    const double most = data_ceiling(mix, bytes_per_second, rate.per_second, rate.real_bytes);
    is_any_short = is_any_short || most < 1;
    text += fmt::format("{}{:.0f} % from {}", text.empty() ? "" : ", ", 100 * most, place);
  };
  for (const CacheRoof& cache : roofs.caches) {
    if (cache.level > 1) add(fmt::format("L{}", cache.level), rate.of(cache));
  }
  add("memory", rate.is_of_cpu ? roofs.bytes_per_cpu_second : roofs.bytes_per_second);
  return is_any_short ? "; its data would allow " + text : std::string();
}

/// The farthest cache that is as fast as bytes were moved.
std::string cache_text(double bytes_per_second, const Roofs& roofs) {
  const CacheRoof* last = nullptr;
  for (const CacheRoof& cache : roofs.caches) {
    if (cache.bytes_per_second >= bytes_per_second) last = &cache;
  }
  if (last == nullptr) return {};
  return fmt::format(", which is {:.0f} % of what L{} gives",
                     100 * bytes_per_second / last->bytes_per_second, last->level);
}

}  // namespace

double load_ceiling(const InstructionMix& mix, const Roofs& roofs, bool is_double) {
  if (roofs.caches.empty() || mix.loads + mix.stores == 0) return 1;
  const CacheRoof& nearest = roofs.caches.front();
  const FmaRate rate = fma_rate(roofs, is_double);
  // Loads, like multiply-adds, are of whole vectors: their ratio is that of reals.
  const double loads_a_multiply_add = rate.of(nearest) / rate.real_bytes / rate.per_second;
  return std::min(1.0, mix.slots() * loads_a_multiply_add / (mix.loads + mix.stores));
}

std::optional<double> ceiling_of(const InstructionMix* mix, const Roofs& roofs, bool is_double) {
  if (mix == nullptr || mix->operations() == 0) return std::nullopt;
  return std::min(mix->ceiling(), load_ceiling(*mix, roofs, is_double));
}

JudgedShare judged_runs(const KernelWork& work, const std::vector<MeasuredRun>& runs, bool is_busy,
                        const InstructionMix* mix) {
  std::map<std::string, std::vector<double>> shares;  // by the limit
  for (const MeasuredRun& run : runs) {
    const Roof roof = roof_of(work, run.spent, run.roofs);
    if (roof.share) shares[roof.limit].push_back(*roof.share);
  }
  if (shares.empty()) return {};
  const auto& [limit, values] =
      *std::ranges::max_element(shares, {}, [](const auto& entry) { return entry.second.size(); });
  return judged(limit, work.at_most, interval_of_median(values), is_busy,
                ceiling_of(mix, runs.back().roofs, work.is_double));
}

std::string limited_by(const KernelWork& work, const Spent& spent, const Roofs& roofs,
                       const std::string& limit, const std::string& verdict,
                       const std::optional<double>& share, const InstructionMix* mix,
                       bool is_busy) {
  const auto known_ceiling = ceiling_of(mix, roofs, work.is_double);
  if (verdict == "not now") {
    std::string why = is_busy ? "cannot be judged now: other programs take the processors"
                              : "cannot be judged: its runs differ too much; give more repeats";
    if (limit != "fma" || !known_ceiling) return why;
    return fmt::format("{}; {}, so the ceiling is {:.0f} %{}; {}", why, operations_text(*mix),
                       100 * *known_ceiling, data_text(*mix, roofs, work.is_double),
                       rest_of_loop(*mix));
  }
  if (limit == "memory") {
    const double rate = spent.seconds > 0 ? work.bytes / spent.seconds : 0;
    if (verdict == "cached") {
      return fmt::format("caches: {:.3g} GB/s of its data{}", 1e-9 * rate, cache_text(rate, roofs));
    }
    if (!share) return {};
    if (*share >= kAtCeiling || mix == nullptr) {
      return fmt::format("memory: {:.0f} % of the copy's bandwidth", 100 * *share);
    }
    return fmt::format("its own instructions: {:.0f} % of the copy's bandwidth; {}; {}",
                       100 * *share, operations_text(*mix), rest_of_loop(*mix));
  }
  if (limit != "fma" || !known_ceiling) return {};
  const double by_loads = load_ceiling(*mix, roofs, work.is_double);
  const double ceiling = *known_ceiling;
  const std::string reached =
      share ? fmt::format("{}{:.0f} % is reached", work.at_most ? "at most " : "", 100 * *share)
            : std::string("no share can be given");
  // The trees of meshes count sums and comparisons as slots too (mesh/tree_walk.hpp).
  constexpr double kMoreThanSlots = 1.2;
  if (share && *share > kMoreThanSlots * ceiling) {
    return fmt::format(
        "not explained: {}, though {}, which would allow {:.0f} % only; the kernel's count of "
        "slots "
        "has more than these operations; {}",
        reached, operations_text(*mix), 100 * ceiling, rest_of_loop(*mix));
  }
  const bool waits = share && *share < kAtCeiling * ceiling;
  const char* const what = waits                       ? "waiting, for data or earlier results"
                           : by_loads < mix->ceiling() ? "loads and stores"
                                                       : "vector operations";
  return fmt::format("{}: {}, so the ceiling is {:.0f} %{}; {}{}; {}", what, operations_text(*mix),
                     100 * ceiling, by_loads < mix->ceiling() ? " for its loads and stores" : "",
                     reached, waits ? data_text(*mix, roofs, work.is_double) : std::string(),
                     rest_of_loop(*mix));
}

}  // namespace qjulia::profiling
