/// Profiles compared, by runs made up: when kernels are called slower, and what is refused.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <nlohmann/json.hpp>
#include <random>

#include "benchmark/alternated.hpp"
#include "benchmark/profile_comparison.hpp"
#include "benchmark/profile_page.hpp"
#include "qjulia/base/error.hpp"

using namespace qjulia;
using namespace qjulia::benchmark;
using Catch::Matchers::ContainsSubstring;
using nlohmann::json;

namespace {

constexpr double kLimit = 5e10;

/// A machine: what share of its speed a run gets at a time, and how exactly a run is timed.
struct TimedMachine {
  std::mt19937_64 random;
  double noise = 0.005;
  bool is_loaded = false;  ///< other programs start, take a part of the time for some runs, and end
  bool counts_cpu = false;  ///< profiles have CPU seconds, which other work does not change
  double share = 1;

  explicit TimedMachine(unsigned seed) : random(seed) {}
  /// CPU seconds that a run takes.
  double used(double seconds) {
    std::normal_distribution<double> normal(1, noise);
    return seconds * std::max(normal(random), 0.5);
  }
  /// Seconds for so many CPU seconds.
  double lasting(double used) {
    std::uniform_real_distribution<double> uniform;
    if (is_loaded && uniform(random) < 0.2) share = 0.3 + 0.7 * uniform(random);
    return used / share;
  }
  double timed(double seconds) { return lasting(used(seconds)); }
};

/// @param slower the factor for the time of the kernel of that number.
json profile_on(TimedMachine& machine, int runs, std::size_t slower_kernel = 99,
                double slower = 1) {
  json kernels = json::array();
  const std::vector<std::pair<const char*, int>> names = {
      {"energy", 1},       {"gradient", 1}, {"energy", 4},    {"gradient", 4},
      {"gauss_newton", 1}, {"distance", 1}, {"level_set", 4}, {"ray_march", 6}};
  for (std::size_t i = 0; i < names.size(); ++i) {
    std::vector<double> seconds, limits, cpu_seconds, cpu_limits;
    for (int run = 0; run < runs; ++run) {
      const double factor = i == slower_kernel ? slower : 1;
      cpu_seconds.push_back(machine.used(0.01 * static_cast<double>(1 + i)) * factor);
      seconds.push_back(machine.lasting(cpu_seconds.back()));
      cpu_limits.push_back(kLimit / machine.used(1));
      limits.push_back(machine.counts_cpu ? kLimit / machine.lasting(kLimit / cpu_limits.back())
                                          : kLimit / machine.timed(1));
    }
    json kept{{"seconds", seconds}, {"fma_per_second", limits}};
    kept["cpu_seconds"] = machine.counts_cpu ? json(cpu_seconds) : json();
    kept["fma_per_cpu_second"] = machine.counts_cpu ? json(cpu_limits) : json();
    kernels.push_back({{"kernel", names[i].first},
                       {"iterations", names[i].second},
                       {"samples", 1000},
                       {"factors", 40},
                       {"width", 16},
                       {"precision", "single"},
                       {"runs", kept}});
  }
  return {{"device", {{"name", "d"}, {"platform", "p"}, {"driver", "1"}}},
          {"layout", "cpu"},
          {"tuning", {{"orbit_group", 1}}},
          {"kernels", kernels}};
}

Verdict verdict(const json& before, const json& after) {
  return compare_profiles(before, after, {}).verdict;
}

}  // namespace

TEST_CASE("a program against itself on a quiet machine is rarely called slower") {
  constexpr int kTrials = 400;
  int slower = 0, undecided = 0;
  for (unsigned trial = 0; trial < kTrials; ++trial) {
    TimedMachine machine(trial);
    machine.noise = 0.03;  // more than the tolerance of 2 %
    const json before = profile_on(machine, 8);
    const Verdict found = verdict(before, profile_on(machine, 8));
    slower += found == Verdict::slower ? 1 : 0;
    undecided += found == Verdict::undecided ? 1 : 0;
  }
  CHECK(slower <= 0.05 * kTrials);
  CHECK(undecided <= 0.05 * kTrials);
}

TEST_CASE("a program against itself under load is never called slower") {
  int undecided = 0;
  for (unsigned trial = 0; trial < 200; ++trial) {
    TimedMachine machine(trial);
    machine.is_loaded = true;
    const json before = profile_on(machine, 5);
    const ProfileComparison found = compare_profiles(before, profile_on(machine, 5), {});
    CHECK(found.verdict != Verdict::slower);
    if (found.verdict != Verdict::undecided) continue;
    ++undecided;
    CHECK_FALSE(found.busy.empty());
  }
  CHECK(undecided > 100);
}

TEST_CASE("under load CPU seconds decide: only the kernel slowed by 5 % is found") {
  int busy = 0;
  for (unsigned trial = 0; trial < 100; ++trial) {
    TimedMachine machine(trial);
    machine.is_loaded = machine.counts_cpu = true;
    const json before = profile_on(machine, 8);
    const json same = profile_on(machine, 8), slower = profile_on(machine, 8, 2, 1.05);
    CHECK(verdict(before, same) != Verdict::slower);
    const ProfileComparison found = compare_profiles(before, slower, {});
    if (found.busy.empty()) continue;
    ++busy;
    CHECK(found.clock == Clock::cpu);
    CHECK(to_json(found)["clock"] == "cpu");
    CHECK(found.kernels[2].verdict == Verdict::slower);
    CHECK(found.kernels[2].ratio->estimate == Catch::Approx(1.05).epsilon(0.02));
    CHECK(found.kernels[2].before_seconds == Catch::Approx(0.03).epsilon(0.02));
    CHECK(std::ranges::count(found.kernels, Verdict::slower, &KernelComparison::verdict) == 1);
    json old_program = slower;  // which knows no CPU seconds
    for (json& kernel : old_program["kernels"]) kernel["runs"].erase("cpu_seconds");
    CHECK(compare_profiles(before, old_program, {}).clock == Clock::device);
  }
  CHECK(busy > 90);
  TimedMachine idle(1);
  idle.counts_cpu = true;
  const json before = profile_on(idle, 8);
  CHECK(compare_profiles(before, profile_on(idle, 8), {}).clock == Clock::device);
}

TEST_CASE("where the limit in a CPU second drifts too, nothing is called slower") {
  TimedMachine machine(1);
  machine.counts_cpu = true;
  const json before = profile_on(machine, 8);
  json after = profile_on(machine, 8, 2, 1.6);
  for (json& kernel : after["kernels"]) {
    for (const char* limit : {"fma_per_second", "fma_per_cpu_second"}) {
      for (json& value : kernel["runs"][limit]) value = 0.7 * value.get<double>();
    }
  }
  const ProfileComparison found = compare_profiles(before, after, {});
  CHECK(found.clock == Clock::cpu);
  CHECK(found.verdict == Verdict::undecided);
  CHECK(found.busy.size() == 2);
}

TEST_CASE("only the kernel slowed by 5 % is found on a quiet machine") {
  for (unsigned trial = 0; trial < 100; ++trial) {
    TimedMachine machine(trial);
    const json before = profile_on(machine, 8);
    const ProfileComparison found = compare_profiles(before, profile_on(machine, 8, 2, 1.05), {});
    CHECK(found.verdict == Verdict::slower);
    CHECK(found.busy.empty());
    REQUIRE(found.kernels.size() == 8);
    CHECK(found.kernels[2].verdict == Verdict::slower);
    CHECK(found.kernels[2].ratio->estimate == Catch::Approx(1.05).epsilon(0.02));
    CHECK(std::ranges::count(found.kernels, Verdict::slower, &KernelComparison::verdict) == 1);
  }
}

TEST_CASE("speed-ups are told, and a slower clock is not a slower kernel") {
  TimedMachine machine(1);
  const json before = profile_on(machine, 8);
  const ProfileComparison faster = compare_profiles(before, profile_on(machine, 8, 0, 0.8), {});
  CHECK(faster.verdict == Verdict::faster);
  CHECK(faster.kernels[0].verdict == Verdict::faster);
  CHECK(to_json(faster)["kernels"][0]["verdict"] == "faster");
  machine.share = 0.95;  // of kernels and limits alike
  CHECK(verdict(before, profile_on(machine, 8)) != Verdict::slower);
  machine.share = 0.7;
  const ProfileComparison drifted = compare_profiles(before, profile_on(machine, 8, 0, 1.5), {});
  CHECK(drifted.verdict == Verdict::undecided);
  REQUIRE(drifted.busy.size() == 1);
  CHECK_THAT(drifted.busy[0], ContainsSubstring("50") && ContainsSubstring("in OLD"));
}

/// Two builds on one machine, of which the new one's kernel of that number is slower.
AlternatedComparison alternated(TimedMachine& machine, double slower, int most_rounds) {
  int rounds = 0;
  Alternation builds;
  builds.old_build = [&](const std::vector<std::string>&) { return profile_on(machine, 3); };
  builds.new_build = [&, slower](const std::vector<std::string>&) {
    return profile_on(machine, 3, 2, slower);
  };
  builds.is_over = [&] { return ++rounds >= most_rounds; };
  return compare_alternated(builds, {});
}

TEST_CASE("two builds in turns: a kernel slowed by 5 % is found, before the time is over") {
  for (unsigned trial = 0; trial < 30; ++trial) {
    TimedMachine machine(trial);
    const AlternatedComparison found = alternated(machine, 1.05, 40);
    CHECK(found.comparison.verdict == Verdict::slower);
    CHECK(found.rounds < 40);
    CHECK(std::ranges::count(found.comparison.kernels, Verdict::slower,
                             &KernelComparison::verdict) == 1);
  }
}

TEST_CASE("two builds in turns: decided kernels are not asked for again") {
  constexpr std::size_t kDistance = 5;
  TimedMachine machine(1);
  int rounds = 0;
  std::vector<std::string> asked;
  Alternation builds;
  builds.old_build = [&](const std::vector<std::string>&) { return profile_on(machine, 3); };
  builds.new_build = [&](const std::vector<std::string>& names) {
    asked = names;
    return profile_on(machine, 3, kDistance, rounds % 2 == 0 ? 0.5 : 2);  // never decided
  };
  builds.is_over = [&] { return ++rounds >= 20; };
  const AlternatedComparison found = compare_alternated(builds, {});
  CHECK(asked == std::vector<std::string>{"distance"});
  CHECK(found.comparison.verdict == Verdict::undecided);
  CHECK(found.comparison.kernels.size() == 8);
}

TEST_CASE("two builds in turns: one build alone is never slower under load, and rarely else") {
  int slower = 0;
  for (unsigned trial = 0; trial < 100; ++trial) {
    TimedMachine machine(trial);
    machine.noise = 0.03;
    slower += alternated(machine, 1, 20).comparison.verdict == Verdict::slower ? 1 : 0;
    machine.is_loaded = true;
    CHECK(alternated(machine, 1, 12).comparison.verdict != Verdict::slower);
  }
  CHECK(slower <= 5);
}

TEST_CASE("two builds in turns: too few rounds decide nothing") {
  TimedMachine machine(3);
  const AlternatedComparison found = alternated(machine, 1.5, 3);
  CHECK(found.comparison.verdict == Verdict::undecided);
  REQUIRE(found.comparison.kernels.size() == 8);
  // One of 12! / (6! 6!) = 924 orders is less than .025 / 8, one of 252 is not.
  CHECK(found.rounds == 3);
  CHECK(found.least_rounds == 6);
  const json shown = to_json(found.comparison);
  for (const json& kernel : shown["kernels"]) {
    for (const char* name : {"ratio", "ratio_low", "ratio_high"}) CHECK(kernel[name].is_null());
    CHECK(kernel["verdict"] == "undecided");
    CHECK(kernel["before_seconds"] > 0);
  }
}

TEST_CASE("two builds in turns under load: a kernel slowed by 5 % is found by CPU seconds") {
  for (unsigned trial = 0; trial < 30; ++trial) {
    TimedMachine machine(trial);
    machine.is_loaded = machine.counts_cpu = true;
    const AlternatedComparison found = alternated(machine, 1.05, 40);
    CHECK(found.comparison.verdict == Verdict::slower);
    CHECK(std::ranges::count(found.comparison.kernels, Verdict::slower,
                             &KernelComparison::verdict) == 1);
  }
}

TEST_CASE("runs that lie far apart decide nothing") {
  TimedMachine machine(5);
  machine.noise = 0.3;
  json before = profile_on(machine, 5), after = profile_on(machine, 5);
  for (json* profile : {&before, &after}) {
    for (json& kernel : (*profile)["kernels"]) {
      kernel["runs"]["fma_per_second"] = std::vector<double>(5, kLimit);
    }
  }
  CHECK(verdict(before, after) == Verdict::undecided);
}

TEST_CASE("a tolerance above 25 % is kept") {
  TimedMachine machine(3);
  const json before = profile_on(machine, 8), after = profile_on(machine, 8, 1, 1.3);
  CHECK(compare_profiles(before, after, {.tolerance = 0.27}).verdict == Verdict::slower);
  CHECK(compare_profiles(before, after, {.tolerance = 0.4}).kernels[1].verdict == Verdict::same);
}

TEST_CASE("what was measured otherwise is refused, or shown as such") {
  TimedMachine machine(1);
  const json before = profile_on(machine, 8);
  const std::vector<std::pair<const char*, json>> others = {{"/device/name", "e"},
                                                            {"/device/platform", "q"},
                                                            {"/device/driver", "2"},
                                                            {"/layout", "gpu"},
                                                            {"/tuning/orbit_group", 64}};
  for (const auto& [place, value] : others) {
    json after = before;
    after[json::json_pointer(place)] = value;
    CHECK_THROWS_WITH(
        compare_profiles(before, after, {}),
        ContainsSubstring("cannot be compared") && ContainsSubstring("--across-devices"));
    ComparisonOptions across;
    across.across = Across::devices;
    const ProfileComparison shown = compare_profiles(before, after, across);
    REQUIRE(shown.differences.size() == 1);
    CHECK_THAT(shown.differences[0], ContainsSubstring("in OLD") && ContainsSubstring("in NEW"));
  }
  CHECK(to_json(compare_profiles(before, before, {}))["between"] == "builds");
  json wide = before;
  for (json& kernel : wide["kernels"]) kernel["width"] = 8;
  CHECK_THROWS_WITH(compare_profiles(before, wide, {}), ContainsSubstring("16 lanes"));
  // All that differs at once.
  wide["device"]["driver"] = "2";
  CHECK_THROWS_WITH(compare_profiles(before, wide, {}),
                    ContainsSubstring("16 lanes") && ContainsSubstring("driver"));
}

TEST_CASE("two drivers of one machine are compared by its limit, with nothing else changed") {
  TimedMachine machine(1);
  const json before = profile_on(machine, 8);
  json after = profile_on(machine, 8, 2, 1.2);
  after["device"] = {{"name", "e"}, {"platform", "q"}, {"driver", "2"}};
  ComparisonOptions drivers, devices;
  drivers.across = Across::drivers;
  devices.across = Across::devices;
  CHECK_THROWS_WITH(
      compare_profiles(before, after, {}),
      ContainsSubstring("--across-drivers if both are of one machine, else --across-devices"));
  const ProfileComparison found = compare_profiles(before, after, drivers);
  CHECK(to_json(found)["between"] == "drivers");
  CHECK(found.differences.size() == 3);
  CHECK(std::ranges::count(found.kernels, Verdict::slower, &KernelComparison::verdict) == 1);
  CHECK(found.kernels[2].verdict == Verdict::slower);
  // The machine's clock is slower by a twentieth: the limit shows it, but not that of another
  // device.
  for (json& kernel : after["kernels"]) {
    for (json& value : kernel["runs"]["seconds"]) value = 1.05 * value.get<double>();
    for (json& value : kernel["runs"]["fma_per_second"]) value = value.get<double>() / 1.05;
  }
  const auto slower = [&](const ComparisonOptions& options) {
    const ProfileComparison compared = compare_profiles(before, after, options);
    return std::ranges::count(compared.kernels, Verdict::slower, &KernelComparison::verdict);
  };
  CHECK(slower(drivers) == 1);
  CHECK(slower(devices) == 8);
  const std::vector<std::pair<const char*, json>> others = {
      {"/layout", "gpu"}, {"/tuning/orbit_group", 64}, {"/device/compute_units", 4}};
  for (const auto& [place, value] : others) {
    json other = after;
    other[json::json_pointer(place)] = value;
    CHECK_THROWS_WITH(compare_profiles(before, other, drivers),
                      ContainsSubstring("or give --across-devices"));
    CHECK(to_json(compare_profiles(before, other, devices))["between"] == "devices");
  }
}

TEST_CASE("what cannot be compared is refused by name") {
  TimedMachine machine(1);
  const json good = profile_on(machine, 8);
  for (const json& bad : {json(nullptr), json::array(), json(3), json::object()}) {
    CHECK_THROWS_WITH(compare_profiles(bad, good, {}), ContainsSubstring("OLD is not a profile"));
    CHECK_THROWS_WITH(compare_profiles(good, bad, {}), ContainsSubstring("NEW is not a profile"));
  }
  const auto changed = [&](const char* place, const json& value) {
    json other = good;
    other[json::json_pointer(place)] = value;
    return other;
  };
  CHECK_THROWS_WITH(compare_profiles(good, changed("/kernels/0/runs", {}), {}),
                    ContainsSubstring("keeps its runs"));
  for (const json& seconds : {json::array(), json{0.1, 0.0}, json{-1.0}, json{0.1}}) {
    CHECK_THROWS_AS(compare_profiles(good, changed("/kernels/0/runs/seconds", seconds), {}),
                    InputError);
  }
  CHECK_THROWS_WITH(compare_profiles(good, changed("/kernels/3/samples", 7), {}),
                    ContainsSubstring("gradient, n = 4") && ContainsSubstring("same --samples"));
  CHECK_THROWS_WITH(compare_profiles(profile_on(machine, 2), good, {}),
                    ContainsSubstring("2 and 8 runs") && ContainsSubstring("--repeats"));
  const ProfileComparison part = compare_profiles(good, changed("/kernels/0/kernel", "new"), {});
  CHECK(part.kernels.size() == 7);
  CHECK(part.left_out ==
        std::vector<std::string>{"energy, n = 1: only in OLD", "new, n = 1: only in NEW"});
  for (const double confidence : {0.5, 1.0, -1.0, std::nan("")}) {
    ComparisonOptions options;
    options.confidence = confidence;
    CHECK_THROWS_WITH(compare_profiles(good, good, options), ContainsSubstring("--confidence"));
  }
}

TEST_CASE("a file of --profile is refused with what to measure in its place") {
  const json of_command{{"kernels", json::array()}, {"stages", json::array()}};
  CHECK_THROWS_WITH(compare_profiles(of_command, of_command, {}),
                    ContainsSubstring("OLD is what one command wrote for --profile") &&
                        ContainsSubstring("--jobs fit --json"));
  CHECK_THROWS_WITH(profile_page({{"fit.json", of_command}}),
                    ContainsSubstring("'fit.json' is what one command wrote"));
}
