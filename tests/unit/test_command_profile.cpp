/// A command's profile, of a trace made up: what its kernels and stages took, and of which limit.

#include <catch2/catch_all.hpp>
#include <nlohmann/json.hpp>

#include "profile/jobs.hpp"
#include "qjulia/command_profile.hpp"

using namespace qjulia;
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
  return command_profile({}, trace, work, {2e10, 1e10, 1e10}, 1);
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
  CHECK(profiling::fits_any("energy_terms", {"gauss*", "energy*"}));
  CHECK(profiling::fits_any("energy", {"energ?"}));
  CHECK_FALSE(profiling::fits_any("energy", {"energ", "energy?", "nergy", ""}));
  CHECK(profiling::fits_any("anything", {"*"}));
}
