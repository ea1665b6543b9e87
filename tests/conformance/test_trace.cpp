// What a trace holds is what the device ran.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <fstream>
#include <nlohmann/json.hpp>

#include "device/context.hpp"
#include "device/device_clock.hpp"
#include "profile/workload.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/field.hpp"
#include "temporary_folder.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

profiling::Workload small_work() {
  ProfileOptions options;
  options.sample_points = 20'000;
  options.factors = 40;
  return profiling::make_workload(options);
}

void run_kernels(const Device& device, const profiling::Workload& work, int times) {
  const Field field(device, work.map);
  const auto points = on_slice(work.samples.position, 0);
  for (int i = 0; i < times; ++i) field.at(points);
}

}  // namespace

TEST_CASE("kernels lie in the trace in order, as long as their times, within the recording") {
  const profiling::Workload work = small_work();
  const Device device = test::shared_device();
  run_kernels(device, work, 1);  // recorded by nobody
  const auto trace = std::make_shared<Trace>();
  const auto begin = Trace::Clock::now();
  device.context().reset_kernel_times();
  device.record(trace);
  run_kernels(device, work, 30);
  device.context().finish();
  const std::int64_t whole = std::chrono::nanoseconds(Trace::Clock::now() - begin).count();
  device.record({});
  run_kernels(device, work, 1);  // by nobody either

  std::int64_t length = 0, last_end = 0;
  for (const Trace::Event& event : trace->events()) {
    CHECK(event.row == Trace::Row::device);
    CHECK(event.timer == Trace::Timer::device);
    CHECK(event.name == "field_at_points");
    CHECK(event.length > 0);
    CHECK(event.start >= last_end);
    last_end = event.start + event.length;
    length += event.length;
  }
  CHECK(trace->events().size() >= 30);
  CHECK(last_end <= whole + 1'000'000);
  // One launch more than was recorded has been timed: that after the recording.
  const auto time = device.context().kernel_times().at("field_at_points");
  CHECK(time.launches == trace->events().size() / 30 * 31);
  CHECK(time.seconds > 1e-9 * static_cast<double>(length));
}

TEST_CASE("kernels stand in the stage that launched them and waited") {
  const profiling::Workload work = small_work();
  const Device device = test::shared_device();
  const auto trace = std::make_shared<Trace>();
  device.record(trace);
  for (const char* name : {"first", "second"}) {
    const TraceStage stage(trace, name);
    run_kernels(device, work, 3);
  }
  device.record({});
  const auto stage = std::ranges::find(trace->events(), "second", &Trace::Event::name);
  REQUIRE(stage != trace->events().end());
  std::ptrdiff_t kernels = 0, within = 0;
  for (const Trace::Event& event : trace->events()) {
    if (event.row != Trace::Row::device) continue;
    ++kernels;
    within +=
        event.start >= stage->start && event.start + event.length <= stage->start + stage->length;
  }
  CHECK(kernels >= 6);
  CHECK(within == kernels / 2);
}

TEST_CASE("a device's clock may be any time apart, and drift") {
  using std::chrono::nanoseconds;
  constexpr nanoseconds kApart{-5'000'000'000'000};
  device::DeviceClock clock;
  nanoseconds last_end{0};
  for (int i = 0; i < 1000; ++i) {
    const nanoseconds before{1'000'000LL * i}, call{2000}, wait{100'000}, length{700'000};
    const nanoseconds apart = kApart + nanoseconds(300LL * i);  // 300 us a second
    const nanoseconds queued = before + call / 2 - apart;
    const auto start =
        clock.on_host({queued, queued + wait, queued + wait + length},
                      Trace::Clock::time_point(before), Trace::Clock::time_point(before + call));
    const nanoseconds error = start.time_since_epoch() - (before + call / 2 + wait);
    CHECK(std::abs(error.count()) <= call.count());
    CHECK(start.time_since_epoch() >= last_end);
    last_end = start.time_since_epoch() + length;
  }
}

TEST_CASE("a trace is written as trace events, whatever names hold") {
  const test::TemporaryFolder folder;
  const auto trace = std::make_shared<Trace>();
  {
    const TraceStage outer(trace, "outer");
    const TraceStage inner(trace, "a \"name\" \\ \n");
  }
  const TraceStage untraced({}, "nothing happens");
  trace->write(folder / "t.json", "a device");
  std::ifstream file(folder / "t.json");
  const auto json = nlohmann::json::parse(file);
  const auto& events = json.at("traceEvents");
  REQUIRE(events.size() == 5);  // the process's name, a row's name and its place
  CHECK(events[3]["name"] == "outer");
  CHECK(events[3]["ph"] == "X");
  CHECK(events[3]["args"]["clock"] == "wall");
  CHECK(events[4]["name"] == "a \"name\" \\ \n");
  CHECK(events[4]["ts"].get<double>() >= events[3]["ts"].get<double>());
  CHECK_THROWS_AS(trace->write(folder / "none/t.json", "a device"), OutputError);
}
