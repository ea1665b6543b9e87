// Counters of kernels: events from a made-up system, and what NVIDIA's assembler writes.

#include <catch2/catch_all.hpp>
#include <cerrno>
#include <functional>
#include <set>

#include "device/kernel_resources.hpp"
#include "profile/process_events.hpp"

using namespace qjulia;
using namespace qjulia::profiling;
using Catch::Matchers::ContainsSubstring;

namespace {

/// What a made-up system counts, by event and thread.
struct MadeUpSystem {
  std::vector<int> threads{100, 101};
  std::function<int(const std::string&, int)> refusal = [](const std::string&, int) { return 0; };
  std::optional<int> paranoia = 2;
  std::vector<EventCalls::Value> values;  ///< by file
  std::vector<std::pair<std::string, int>> opened;
  std::set<int> closed;
};

class MadeUpCalls final : public EventCalls {
 public:
  explicit MadeUpCalls(MadeUpSystem& system) : system_(system) {}
  std::vector<int> threads() override { return system_.threads; }
  int open(const EventKind& kind, int thread) override {
    if (const int error = system_.refusal(kind.name, thread)) return -error;
    system_.opened.emplace_back(kind.name, thread);
    system_.values.emplace_back();
    return static_cast<int>(system_.values.size()) - 1;
  }
  Value read(int file) override { return system_.values.at(static_cast<std::size_t>(file)); }
  void close(int file) override { system_.closed.insert(file); }
  std::optional<int> paranoia() override { return system_.paranoia; }

 private:
  MadeUpSystem& system_;
};

/// Why all events are refused with this error.
std::string refused_with(int error, std::optional<int> paranoia) {
  MadeUpSystem system;
  system.refusal = [error](const std::string&, int) { return error; };
  system.paranoia = paranoia;
  const ProcessEvents events(std::make_unique<MadeUpCalls>(system));
  REQUIRE(events.refused().size() == 1);
  CHECK(events.is_empty());
  CHECK_THAT(events.refused().front(), ContainsSubstring("cycles, instructions, cache_misses"));
  return events.refused().front();
}

}  // namespace

TEST_CASE("events of all threads are added, and scaled where counters took turns") {
  MadeUpSystem system;
  {
    ProcessEvents events(std::make_unique<MadeUpCalls>(system));
    CHECK(events.refused().empty());
    REQUIRE(system.opened.size() == 14);
    const auto before = events.read();
    for (std::size_t file = 0; file < system.opened.size(); ++file) {
      const auto& [name, thread] = system.opened[file];
      // Cycles were counted for a quarter of the time, instructions not at all.
      const std::uint64_t counted = name == "cycles" ? 250 : name == "instructions" ? 0 : 1000;
      system.values[file] = {thread == 100 ? 5'000'000U : 2'000'000U, 1000, counted};
    }
    const auto counts = events.between(before, events.read());
    CHECK(counts.at("cycles") == Catch::Approx(4 * 7e6));
    CHECK_FALSE(counts.contains("instructions"));
    CHECK(counts.at("cache_misses") == Catch::Approx(7e6));
    CHECK(counts.at("cpu_seconds") == Catch::Approx(7e-3));
    // Nothing happened since.
    CHECK(events.between(events.read(), events.read()).at("page_faults") == 0);
  }
  CHECK(system.closed.size() == 14);
}

TEST_CASE("a thread that has ended is passed over, an event that the processor lacks is named") {
  MadeUpSystem system;
  system.refusal = [](const std::string& name, int thread) {
    return thread == 100 ? ESRCH : name.starts_with("stalled") ? ENOENT : 0;
  };
  const ProcessEvents events(std::make_unique<MadeUpCalls>(system));
  REQUIRE(events.refused().size() == 1);
  CHECK_THAT(events.refused().front(), ContainsSubstring("stalled_frontend, stalled_backend: ") &&
                                           ContainsSubstring("virtual machines"));
  CHECK(system.opened.size() == 5);
}

TEST_CASE("a refusal says what refuses and what helps") {
  CHECK_THAT(refused_with(EACCES, 4),
             ContainsSubstring("perf_event_paranoid is 4") && ContainsSubstring("sysctl"));
  CHECK_THAT(refused_with(EPERM, 2),
             ContainsSubstring("containers") && ContainsSubstring("PERFMON"));
  CHECK_THAT(refused_with(ENOSYS, std::nullopt), ContainsSubstring("no perf_event_open"));
  CHECK_THAT(refused_with(EMFILE, 2), ContainsSubstring("errno " + std::to_string(EMFILE)));
}

TEST_CASE("registers are read from the log of NVIDIA's assembler") {
  const std::string log =
      "ptxas info    : 0 bytes gmem\n"
      "ptxas info    : Compiling entry function 'sum_row_blocks' for 'sm_90'\n"
      "    0 bytes stack frame, 0 bytes spill stores, 0 bytes spill loads\n"
      "ptxas info    : Used 18 registers, used 0 barriers, 400 bytes cmem[0]\n"
      "ptxas info    : Compiling entry function 'sum_row' for 'sm_90'\n"
      "    16 bytes stack frame, 12 bytes spill stores, 8 bytes spill loads\n"
      "ptxas info    : Used 255 registers, used 0 barriers, 400 bytes cmem[0]\n";
  CHECK(device::assembler_figures(log, "sum_row_blocks").registers == 18);
  CHECK(device::assembler_figures(log, "sum_row_blocks").spilled_bytes == 0);
  CHECK(device::assembler_figures(log, "sum_row").registers == 255);
  CHECK(device::assembler_figures(log, "sum_row").spilled_bytes == 12);
  CHECK_FALSE(device::assembler_figures(log, "sum").registers);
  CHECK_FALSE(device::assembler_figures({}, "sum_row").registers);
}
