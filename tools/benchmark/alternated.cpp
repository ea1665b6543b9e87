#include "benchmark/alternated.hpp"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "benchmark/ratio_bounds.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::benchmark {
namespace {

using nlohmann::json;

using KernelKey = std::pair<std::string, int>;  ///< name and n

KernelKey key_of(const json& kernel) { return {kernel.at("kernel"), kernel.at("iterations")}; }

/// A list of a kernel's runs in a profile, and whether its smaller values are the less disturbed
/// ones.
struct Kept {
  const char* name;
  bool is_least_best;
};
constexpr std::array kByDevice{Kept{"seconds", true}, Kept{"fma_per_second", false}};
constexpr std::array kByCpu{Kept{"cpu_seconds", true}, Kept{"fma_per_cpu_second", false}};

/// The value of a process's runs that other programs have disturbed least: the fastest run's and
/// the highest limit.
double least_disturbed(const json& runs, const Kept& kept) {
  const auto values = runs.at(kept.name).get<std::vector<double>>();
  if (values.empty())
    throw InputError("a build's profile keeps no runs with the limits beside them");
  return kept.is_least_best ? std::ranges::min(values) : std::ranges::max(values);
}

bool has(const json& runs, const std::array<Kept, 2>& kept) {
  return std::ranges::all_of(
      kept, [&](const Kept& k) { return runs.contains(k.name) && !runs.at(k.name).is_null(); });
}

/// One build's profiles: the first, whose kernels' runs are those of all.
struct Gathered {
  json all;

  void add(const json& profile) {
    if (all.is_null()) {
      all = profile;
      for (json& kernel : all.at("kernels")) {
        const bool has_cpu = has(kernel.at("runs"), kByCpu);
        kernel["runs"] = json::object();
        for (const Kept& kept : kByDevice) kernel["runs"][kept.name] = json::array();
        for (const Kept& kept : kByCpu) {
          if (has_cpu) kernel["runs"][kept.name] = json::array();
        }
      }
    }
    for (const json& kernel : profile.at("kernels")) {
      for (json& gathered : all.at("kernels")) {
        if (key_of(gathered) != key_of(kernel)) continue;
        for (const auto& kept : {kByDevice, kByCpu}) {
          if (!has(gathered.at("runs"), kept)) continue;
          for (const Kept& k : kept) {
            gathered["runs"][k.name].push_back(least_disturbed(kernel.at("runs"), k));
          }
        }
      }
    }
  }

  /// The median of a kernel's seconds.
  double median_seconds(const KernelKey& key) const {
    for (const json& kernel : all.at("kernels")) {
      if (key_of(kernel) != key) continue;
      auto seconds = kernel.at("runs").at("seconds").get<std::vector<double>>();
      std::ranges::sort(seconds);
      return seconds.at(seconds.size() / 2);
    }
    return 0;
  }

  json only(const std::set<KernelKey>& wanted) const {
    json part = all;
    part["kernels"] = json::array();
    for (const json& kernel : all.at("kernels")) {
      if (wanted.contains(key_of(kernel))) part["kernels"].push_back(kernel);
    }
    return part;
  }
};

std::set<KernelKey> common_to(const Gathered& a, const Gathered& b) {
  std::set<KernelKey> first, both;
  for (const json& kernel : a.all.at("kernels")) first.insert(key_of(kernel));
  for (const json& kernel : b.all.at("kernels")) {
    if (first.contains(key_of(kernel))) both.insert(key_of(kernel));
  }
  return both;
}

/// Whether so many runs of each allow any bound at this error.
bool are_enough(int rounds, double error) {
  const auto n = static_cast<std::size_t>(rounds);
  return mann_whitney_chance(n, n, 0) <= error;
}

bool is_decided(const KernelComparison& kernel, double tolerance) {
  switch (kernel.verdict) {
    case Verdict::slower:
    case Verdict::faster:
      return true;
    case Verdict::same:
      return kernel.ratio && kernel.ratio->high <= 1 + tolerance;
    case Verdict::undecided:
      break;
  }
  return false;
}

/// The error that this comparison may spend, after so many others.
double error_of_look(const ComparisonOptions& options, int looks) {
  return (1 - options.confidence) / (double(looks + 1) * (looks + 2));
}

Verdict worst_of(const std::vector<KernelComparison>& kernels) {
  for (const Verdict worst : {Verdict::slower, Verdict::undecided, Verdict::faster}) {
    if (std::ranges::find(kernels, worst, &KernelComparison::verdict) != kernels.end()) {
      return worst;
    }
  }
  return Verdict::same;
}

}  // namespace

AlternatedComparison compare_alternated(const Alternation& builds,
                                        const ComparisonOptions& options) {
  options.validate();
  constexpr int kFirstLook = 6;
  Gathered old, now;
  AlternatedComparison result;
  std::set<KernelKey> open;
  std::size_t all = 0;
  int looks = 0, next_look = kFirstLook;
  std::vector<KernelComparison> latest;  // of every kernel that was looked at
  for (bool is_last = false; !is_last;) {
    std::vector<std::string> names;
    for (const auto& [name, n] : open) {
      if (names.empty() || names.back() != name) names.push_back(name);
    }
    const bool old_first = result.rounds % 2 == 0;
    if (old_first) old.add(builds.old_build(names));
    now.add(builds.new_build(names));
    if (!old_first) old.add(builds.old_build(names));
    ++result.rounds;
    if (result.rounds == 1) {
      open = common_to(old, now);
      all = open.size();
      if (all == 0) throw InputError("the two builds have no kernel in common");
    }
    is_last = builds.is_over();
    const double error = error_of_look(options, looks);
    const double share = static_cast<double>(open.size()) / static_cast<double>(all);
    if ((result.rounds >= next_look || is_last) &&
        are_enough(result.rounds, error / static_cast<double>(all))) {
      ++looks;
      next_look = result.rounds + std::max(2, result.rounds / 3);
      ComparisonOptions look = options;
      look.confidence = 1 - error * share;
      const ProfileComparison found = compare_profiles(old.only(open), now.only(open), look);
      result.comparison.between = found.between;
      result.comparison.clock = found.clock;
      result.comparison.differences = found.differences;
      result.comparison.busy = found.busy;
      for (const KernelComparison& kernel : found.kernels) {
        std::erase_if(latest, [&](const KernelComparison& k) {
          return k.kernel == kernel.kernel && k.iterations == kernel.iterations;
        });
        latest.push_back(kernel);
        if (is_decided(kernel, options.tolerance)) open.erase({kernel.kernel, kernel.iterations});
      }
      if (open.empty()) is_last = true;
    }
    if (builds.on_round) builds.on_round(result.rounds, open.size());
  }
  for (const KernelKey& key : open) {
    const bool was_seen = std::ranges::any_of(latest, [&](const KernelComparison& k) {
      return k.kernel == key.first && k.iterations == key.second;
    });
    if (was_seen) continue;
    latest.push_back({key.first,
                      key.second,
                      old.median_seconds(key),
                      now.median_seconds(key),
                      {},
                      Verdict::undecided});
  }
  const double first_error = error_of_look(options, 0) / static_cast<double>(all);
  while (!are_enough(++result.least_rounds, first_error)) continue;
  std::ranges::sort(latest, {},
                    [](const KernelComparison& k) { return KernelKey(k.kernel, k.iterations); });
  result.comparison.kernels = std::move(latest);
  result.comparison.verdict = worst_of(result.comparison.kernels);
  return result;
}

}  // namespace qjulia::benchmark
