#include "profile/explain.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>

#include "profile/processor_watch.hpp"

namespace qjulia::profiling {
namespace {

std::string counted(int number, const char* one) {
  return fmt::format("{} {}{}", number, one, number == 1 ? "" : "s");
}

/// What a pass of the loop has.
std::string loop_text(const InstructionMix& mix) {
  std::vector<std::string> slots;
  if (mix.multiply_adds > 0) slots.push_back(counted(mix.multiply_adds, "multiply-add"));
  if (mix.multiplications > 0) slots.push_back(counted(mix.multiplications, "multiplication"));
  if (mix.divisions > 0) slots.push_back(counted(mix.divisions, "division"));
  std::string text = fmt::format(
      "a pass of its main loop ({:.0f} % of its time) has {}", 100 * mix.time_share,
      slots.empty() ? "nothing that counts" : fmt::format("{}", fmt::join(slots, ", ")));
  if (mix.others > 0) {
    text += fmt::format(
        " and {} (sums, comparisons, shuffles, conversions), which {} count as "
        "slots",
        counted(mix.others, "other vector operation"), mix.others == 1 ? "does not" : "do not");
  }
  text +=
      fmt::format(", beside {} and {}", counted(mix.loads, "load"), counted(mix.stores, "store"));
  return mix.spills > 0 ? text + fmt::format(", {} of them on the stack", mix.spills) : text;
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

/// The share that a loop can reach if all of its loads and stores go to one place.
struct DataPlace {
  std::string name;
  double most = 1;
};

/// The places behind the nearest cache, nearest first.
std::vector<DataPlace> data_places(const InstructionMix& mix, const Roofs& roofs, bool is_double) {
  const FmaRate rate = fma_rate(roofs, is_double);
  std::vector<DataPlace> places;
  const auto add = [&](const std::string& name, double bytes_per_second) {
    places.push_back({name, data_ceiling(mix, bytes_per_second, rate.per_second, rate.real_bytes)});
  };
  for (const CacheRoof& cache : roofs.caches) {
    if (cache.level > 1) add(fmt::format("L{}", cache.level), rate.of(cache));
  }
  add("memory", rate.is_of_cpu ? roofs.bytes_per_cpu_second : roofs.bytes_per_second);
  return places;
}

/// What a kernel waits for, and why that is known.
struct Waiting {
  std::string cause, reason;
};

/// Of a kernel that reaches less than its operations allow.
Waiting waiting_of(const InstructionMix& mix, const Roofs& roofs, bool is_double, double share) {
  const std::vector<DataPlace> places = data_places(mix, roofs, is_double);
  const std::string itself = "its own earlier results or units that its operations share";
  if (std::ranges::all_of(places, [&](const DataPlace& place) { return place.most >= share; })) {
    return {"waiting, for " + itself,
            "; data is not the cause, since even memory would give it faster"};
  }
  std::string text;
  for (const DataPlace& place : places) {
    text +=
        fmt::format("{}{:.0f} % if all came from {}",
                    text.empty() ? "; its data would allow " : ", ", 100 * place.most, place.name);
  }
  const auto far =
      std::ranges::find_if(places, [&](const DataPlace& place) { return place.most < share; });
  const DataPlace near = far == places.begin() ? DataPlace{"L1", 1} : *(far - 1);
  // Times of the two parts add up: 1 / share = part / far + (1 - part) / near.
  const double part = (1 / share - 1 / near.most) / (1 / far->most - 1 / near.most);
  text += fmt::format(". If data is the cause, {:.0f} % of it comes from {} and the rest from {}",
                      100 * part, far->name, near.name);
  return {"waiting, for data or for " + itself, text};
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

std::optional<CodeBounds> bounds_of(const InstructionMix* mix, const Roofs& roofs, bool is_double) {
  if (mix == nullptr || mix->operations() == 0) return std::nullopt;
  return CodeBounds{std::min(mix->ceiling(), load_ceiling(*mix, roofs, is_double)),
                    data_places(*mix, roofs, is_double).back().most};
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
                bounds_of(mix, runs.back().roofs, work.is_double));
}

namespace {

/// Why a share is not judged, and what to do.
std::string doubt_text(const JudgedShare& judged, const Conditions& with) {
  switch (judged.doubt) {
    case Doubt::none:
      return {};
    case Doubt::other_programs: {
      const auto found = with.use ? reasons(*with.use) : std::vector<std::string>();
      const bool is_quota = with.use && with.use->throttled_times > 0;
      return fmt::format(
          "not judged now, because {}: alone it reaches as much or more; {} and repeat it",
          found.empty() ? std::string("its threads waited for processors")
                        : fmt::format("{}", fmt::join(found, " and ")),
          is_quota ? "raise the quota" : "close other programs");
    }
    case Doubt::spread:
      return with.runs > 0
                 ? "not judged, because its runs lie too far apart; repeat it with more runs"
                 : "not judged, because the limits before and after the command lie too far apart; "
                   "repeat it";
    case Doubt::above_limit:
      break;
  }
  return "not judged, because it was faster than the limit that was measured beside it; repeat it";
}

/// "55 % is reached", "54 to 58 % was seen in 9 runs".
std::string reached_text(const KernelWork& work, const JudgedShare& judged,
                         const Conditions& with) {
  if (judged.share) {
    return fmt::format("{}{:.0f} % is reached", work.at_most ? "at most " : "",
                       100 * *judged.share);
  }
  if (!judged.low) return "no share can be given";
  const std::string low = fmt::format("{:.0f}", 100 * *judged.low);
  const std::string high = fmt::format("{:.0f}", 100 * *judged.high);
  return fmt::format(
      "{} % was seen{}", low == high ? low : low + " to " + high,
      with.runs > 0 ? " in " + counted(static_cast<int>(with.runs), "run") : std::string());
}

/// What bounds a kernel that multiply-adds limit, of a known mix.
std::string fma_text(const KernelWork& work, const JudgedShare& judged, const Conditions& with) {
  const InstructionMix& mix = *with.mix;
  const double ceiling = bounds_of(&mix, with.roofs, work.is_double)->ceiling;
  const bool is_of_loads = load_ceiling(mix, with.roofs, work.is_double) < mix.ceiling();
  const auto share = judged.seen();
  const std::string reached = reached_text(work, judged, with);
  // The trees of meshes count sums and comparisons as slots too (mesh/tree_walk.hpp).
  constexpr double kMoreThanSlots = 1.2;
  if (share && *share > kMoreThanSlots * ceiling) {
    return fmt::format(
        "not explained: {}, though {}, which would allow {:.0f} % only. The kernel's count of "
        "slots has more than these operations",
        reached, loop_text(mix), 100 * ceiling);
  }
  Waiting waiting{is_of_loads ? "loads and stores" : "vector operations", ""};
  if (share && *share < kAtCeiling * ceiling) {
    waiting = waiting_of(mix, with.roofs, work.is_double, *share);
  }
  return fmt::format(
      "{}: {}, so the ceiling is {:.0f} %{}; {}{}{}", waiting.cause, loop_text(mix), 100 * ceiling,
      is_of_loads ? " for its loads and stores" : "", reached,
      share ? fmt::format(", {:.0f} % of the ceiling", 100 * *share / ceiling) : std::string(),
      waiting.reason);
}

std::string memory_text(const KernelWork& work, const Spent& spent, const JudgedShare& judged,
                        const Conditions& with) {
  if (judged.verdict == "cached") {
    const double rate = spent.seconds > 0 ? work.bytes / spent.seconds : 0;
    return fmt::format("caches: {:.3g} GB/s of its data{}", 1e-9 * rate,
                       cache_text(rate, with.roofs));
  }
  const auto share = judged.seen();
  if (!share) return {};
  const std::string reached = reached_text(work, judged, with) + " of the copy's bandwidth";
  if (*share >= kAtCeiling || with.mix == nullptr) return "memory: " + reached;
  return fmt::format("its own instructions: {}; {}", reached, loop_text(*with.mix));
}

}  // namespace

std::string limited_by(const KernelWork& work, const Spent& spent, const JudgedShare& judged,
                       const Conditions& with) {
  std::string text;
  if (judged.limit == "memory") {
    text = memory_text(work, spent, judged, with);
  } else if (judged.limit == "fma" && bounds_of(with.mix, with.roofs, work.is_double)) {
    text = fma_text(work, judged, with);
  } else if (judged.doubt != Doubt::none) {
    text = reached_text(work, judged, with);
  }
  const std::string doubt = doubt_text(judged, with);
  if (doubt.empty()) return text;
  return text.empty() ? doubt : text + "; " + doubt;
}

std::string launches_text(std::uint64_t launches) {
  return fmt::format("{} launch{}", launches, launches == 1 ? "" : "es");
}

std::string size_text(const std::optional<LaunchSizes>& sizes) {
  if (!sizes || sizes->most.terms == 0) return {};
  const auto text = [](const LaunchSize& size, const std::string& points) {
    return fmt::format("{}{} {} x {} points",
                       size.parts > 1 ? fmt::format("{} x ", size.parts) : std::string(),
                       size.terms, size.terms_are, points);
  };
  const auto& [least, most] = *sizes;
  const std::string few = std::to_string(least.points), many = std::to_string(most.points);
  if (least.parts == most.parts && least.terms == most.terms) {
    return text(most, few == many ? few : few + " to " + many);
  }
  return text(least, few) + " to " + text(most, many);
}

}  // namespace qjulia::profiling
