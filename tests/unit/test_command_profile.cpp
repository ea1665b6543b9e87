/// A command's profile, of a trace made up: what its kernels and stages took, and of which limit.

#include <catch2/catch_all.hpp>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "profile/command_profile.hpp"
#include "profile/interval.hpp"
#include "profile/jobs.hpp"
#include "profile/roof.hpp"
#include "profile/worker_clock.hpp"

using namespace qjulia;
using namespace qjulia::profiling;
using namespace std::chrono_literals;
using Catch::Matchers::ContainsSubstring;

namespace {

const Trace::Clock::time_point kBegin{};

CommandProfile made_up() {
  Trace trace(kBegin);
  using enum Trace::Row;
  const auto add = [&](const char* name, Trace::Row row, std::chrono::milliseconds from,
                       std::chrono::milliseconds length) {
    trace.add(name, row, Trace::Timer::device, kBegin + from, length);
  };
  add("energy_terms", device, 100ms, 200ms);
  add("energy_terms", device, 400ms, 100ms);
  add("sum_row_blocks", second_queue, 250ms, 100ms);  // beside the first
  add("other", device, 900ms, 50ms);
  add("minimise", host, 0ms, 450ms);
  add("qjulia", host, 0ms, 1000ms);
  const std::map<std::string, KernelWork> work{
      {"energy_terms", {.launches = 2, .slots = 3e9, .bytes = 1e6, .at_most = true}},
      {"sum_row_blocks", {.launches = 1, .bytes = 2e8}}};
  CommandMeasure measure;
  measure.roofs = {2e10, 1e10, 1e10};
  return command_profile({}, trace, work, measure, 1);
}

/// A kernel of a CPU with two processors that do 1e10 multiply-adds a second each. For a part of
/// its time, the threads that run it waited for a processor. It moves almost no bytes, or does
/// nothing but move bytes.
CommandProfile loaded(double waited, double pace_before = 1e10,
                      const KernelWork& work = {.slots = 1e9}) {
  Trace trace(kBegin);
  // Idle, these two processors take 100 ms for it.
  const double seconds = 0.1 / (1 - waited);
  trace.add("energy_terms", Trace::Row::device, Trace::Timer::device, kBegin + 200ms,
            std::chrono::nanoseconds(std::llround(1e9 * seconds)));
  const std::int64_t end = 200'000'000 + std::llround(1e9 * seconds);
  CommandMeasure measure;
  measure.roofs = {2e10 * (1 - waited), 1e10, 1e10, 1e10, 5e9, 5e9};
  measure.fma_per_second_before = 2e10;
  measure.fma_per_cpu_second_before = pace_before;
  measure.cpu = {{0, 3}, {200'000'000, 3}, {end, 3.2}, {end + 100'000'000, 3.2}};
  measure.waited_share = waited;
  DeviceInfo device;
  device.compute_units = 2;
  return command_profile(device, trace, {{"energy_terms", work}}, measure, 1);
}

}  // namespace

TEST_CASE("a command's profile has each kernel's time, share and limit") {
  const CommandProfile profile = made_up();
  REQUIRE(profile.kernels.size() == 3);
  const KernelShare& energy = profile.kernels[0];
  CHECK(energy.kernel == "energy_terms");
  CHECK(energy.launches == 2);
  CHECK(energy.seconds == Catch::Approx(0.3));
  CHECK(energy.share == Catch::Approx(0.3 / 0.45));
  CHECK(energy.limit == "fma");
  CHECK(*energy.share_of_limit == Catch::Approx(3e9 / 2e10 / 0.3));
  CHECK(profile.kernels[1].limit == "memory");
  CHECK(*profile.kernels[1].share_of_limit == Catch::Approx(2e8 / 1e10 / 0.1));
  CHECK(profile.kernels[2].limit.empty());
  CHECK_THAT(to_text(profile), ContainsSubstring("<50.0 % fma"));
  CHECK_FALSE(energy.cpu_seconds);
  CHECK(profile.disturbances().empty());
}

TEST_CASE("a command's share on a CPU is that of its CPU seconds, however long it waited") {
  for (const double waited : {0.0, 0.5, 0.9}) {
    const CommandProfile profile = loaded(waited);
    const KernelShare& energy = profile.kernels[0];
    CHECK(*energy.cpu_seconds == Catch::Approx(0.2));
    CHECK(energy.share_verdict == "judged");
    CHECK(*energy.share_of_limit == Catch::Approx(0.5));
    CHECK(energy.share_low == energy.share_high);
    CHECK(profile.disturbances().size() == (waited > 0 ? 2 : 0));
    CHECK(to_json(profile)["disturbances"].size() == profile.disturbances().size());
  }
  CHECK_THAT(loaded(0.5).disturbances()[0], ContainsSubstring("waited for a processor for 50 %"));
  CHECK_THAT(loaded(0.5).disturbances()[1], ContainsSubstring("20.0 G/s before and 10.0 after"));
}

TEST_CASE("a command's share lies between those by the limits before and after it") {
  const KernelShare drifted = loaded(0, 1.2e10).kernels[0];
  CHECK(*drifted.share_low == Catch::Approx(0.5 / 1.2));
  CHECK(*drifted.share_high == Catch::Approx(0.5));
  CHECK(*drifted.share_of_limit == Catch::Approx(0.5 / std::sqrt(1.2)));
  CHECK_THAT(to_text(loaded(0, 1.2e10)), ContainsSubstring("45.6 % (41.7 to 50.0) fma"));
  const CommandProfile unclear = loaded(0, 2e10);
  CHECK_FALSE(unclear.kernels[0].share_of_limit);
  CHECK_THAT(to_text(unclear), ContainsSubstring("not now (25.0 to 50.0) fma"));
  CHECK(to_json(unclear)["kernels"][0]["share_of_limit"].is_null());
}

TEST_CASE(
    "a memory share uses the device's seconds and cannot be judged while other programs run") {
  const KernelWork copy{.bytes = 5e8};
  CHECK(*loaded(0, 1e10, copy).kernels[0].share_of_limit == Catch::Approx(0.5));
  CHECK(loaded(0.5, 1e10, copy).kernels[0].share_verdict == "not now");
}

TEST_CASE("no share is above 1") {
  const auto shown = [](const char* limit, bool at_most, const Interval& shares) {
    return judged(limit, at_most, shares, false, std::nullopt);
  };
  CHECK(shown("memory", false, {1.4, 1.5, 1.6}).verdict == "cached");
  CHECK(shown("fma", true, {1.4, 1.5, 1.6}).verdict == "ends early");
  CHECK(shown("fma", false, {1.4, 1.5, 1.6}).verdict == "not now");
  CHECK(shown("fma", false, {0.5, 0.6, 0.7}).verdict == "not now");
  CHECK(shown("fma", false, {0.5, std::nan(""), std::nan("")}).verdict == "not now");
  const JudgedShare full = shown("fma", false, {0.97, 1.02, 1.05});
  CHECK(full.verdict == "judged");
  CHECK(full.share == 1);
  CHECK(full.low == 0.97);
  CHECK(full.high == 1);
  CHECK(shown("", false, {1, 1, 1}).verdict.empty());
}

TEST_CASE("beside other programs only kernels that cannot wait for data are judged") {
  const auto verdict = [](const Interval& shares, bool is_busy, std::optional<CodeBounds> bounds) {
    return judged("fma", false, shares, is_busy, bounds).verdict;
  };
  CHECK(verdict({0.58, 0.59, 0.62}, true, CodeBounds{0.57, 0.1}) == "judged");  // at its ceiling
  // Its data may have been driven out of the caches, unless memory gives it as fast.
  CHECK(verdict({0.50, 0.51, 0.52}, true, CodeBounds{1.0, 0.2}) == "not now");
  CHECK(verdict({0.50, 0.51, 0.52}, true, CodeBounds{1.0, 0.6}) == "judged");
  CHECK(verdict({0.50, 0.51, 0.52}, false, CodeBounds{1.0, 0.2}) == "judged");
  CHECK(verdict({0.50, 0.51, 0.52}, true, std::nullopt) == "judged");
  CHECK(verdict({0.50, 0.53, 0.56}, true, std::nullopt) == "not now");
}

TEST_CASE("a share that is not judged says what was seen and why it is doubted") {
  const auto of = [](const Interval& shares, bool is_busy, const CodeBounds& bounds) {
    return judged("fma", false, shares, is_busy, bounds);
  };
  const JudgedShare beside = of({0.50, 0.51, 0.52}, true, {1.0, 0.2});
  CHECK_FALSE(beside.share);
  CHECK((beside.low == 0.50 && beside.high == 0.52));
  CHECK(beside.doubt == Doubt::other_programs);
  CHECK(of({0.5, 0.6, 0.7}, false, {}).doubt == Doubt::spread);
  const JudgedShare above = of({1.1, 1.2, 1.3}, false, {});
  CHECK(above.doubt == Doubt::above_limit);
  CHECK_FALSE(above.low);  // no share is above 1
  CHECK(of({0.9, 1.1, 1.3}, false, {}).high == 1);
  CHECK(verdict_text("not now", 0.541, 0.58) == "not now (54.1 to 58.0)");
  CHECK(verdict_text("cached", {}, {}) == "cached");
  CHECK(verdict_text("", {}, {}) == "-");
}

TEST_CASE("CPU seconds between two samples are divided among the kernels that ran then") {
  const auto at = [](std::chrono::milliseconds time) { return kBegin + time; };
  const std::vector<KernelSpan> kernels{{at(10ms), 20ms}, {at(30ms), 10ms}, {at(60ms), 30ms},
                                        {at(65ms), 5ms},  {at(200ms), 2ms}, {at(220ms), 9ms}};
  const std::vector<CpuSample> samples{{at(0ms), 1},     {at(20ms), 1.02},  {at(40ms), 1.05},
                                       {at(55ms), 1.06}, {at(100ms), 1.13}, {at(199ms), 1.13},
                                       {at(210ms), 1.15}};
  const std::vector<double> seconds = cpu_seconds_of(kernels, samples, 2);
  REQUIRE(seconds.size() == 6);
  CHECK(seconds[0] == Catch::Approx(0.02 + 0.015));
  CHECK(seconds[1] == Catch::Approx(0.015));
  CHECK(seconds[2] == Catch::Approx(0.07 * 30 / 35));
  CHECK(seconds[3] == Catch::Approx(0.07 * 5 / 35));
  CHECK(seconds[4] == Catch::Approx(0.004));  // two processors; the driver used the rest
  CHECK(seconds[5] == 0);                     // after the last sample
  CHECK(cpu_seconds_of(kernels, {}, 2) == std::vector<double>(6, 0));
}

TEST_CASE("an interval of runs holds the median that they scatter about") {
  const auto few = interval_of_median({3, 1, 2, 9});
  CHECK(few.low == 1);
  CHECK(few.middle == Catch::Approx(std::sqrt(6)));
  CHECK(few.high == 9);
  const auto one = interval_of_median({4});
  CHECK((one.low == 4 && one.middle == 4 && one.high == 4));
  // Of ten runs the second and the ninth: 1 + 10 of 1024 orders leave the median below the second.
  const auto ten = interval_of_median({10, 9, 8, 7, 6, 5, 4, 3, 2, 1});
  CHECK(ten.low == 2);
  CHECK(ten.high == 9);
  std::mt19937_64 random(1);
  std::lognormal_distribution<double> skewed(0, 1);  // of median 1
  for (const std::size_t runs : {5U, 12U, 60U}) {
    constexpr int kTrials = 2000;
    int held = 0;
    for (int trial = 0; trial < kTrials; ++trial) {
      std::vector<double> values(runs);
      for (double& value : values) value = skewed(random);
      const auto interval = interval_of_median(values);
      held += interval.low <= 1 && 1 <= interval.high ? 1 : 0;
    }
    CHECK(held >= (kIntervalConfidence - 0.02) * kTrials);
  }
}

TEST_CASE("kernels that run beside each other are the device's time once") {
  const CommandProfile profile = made_up();
  CHECK(profile.device_seconds == Catch::Approx(0.2 + 0.05 + 0.1 + 0.05));
  REQUIRE(profile.stages.size() == 2);
  CHECK(profile.stages[1].stage == "minimise");
  CHECK(profile.stages[1].device_seconds == Catch::Approx(0.25 + 0.05));
  CHECK(to_json(profile)["host_seconds"].get<double>() == Catch::Approx(0.6));
}

TEST_CASE("patterns choose kernels by name") {
  CHECK(fits_any("energy_terms", {"gauss*", "energy*"}));
  CHECK(fits_any("energy", {"energ?"}));
  CHECK_FALSE(fits_any("energy", {"energ", "energy?", "nergy", ""}));
  CHECK(fits_any("anything", {"*"}));
}
