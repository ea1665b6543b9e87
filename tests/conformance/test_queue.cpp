// How much a queue holds, how often the host waits for it, and what a device without room gets.

#include <algorithm>
#include <catch2/catch_all.hpp>

#include "device/context.hpp"
#include "device/point_batch.hpp"
#include "energy/evaluator.hpp"
#include "random_maps.hpp"
#include "test_device.hpp"

using namespace qjulia;
using Catch::Matchers::ContainsSubstring;

namespace {

/// Runs chains of multiply-adds for some milliseconds.
class Chains {
 public:
  explicit Chains(device::Context& context)
      : context_(context),
        kernel_(context.kernel("limits.cl", "fma_chains", {8, Precision::single, {}})),
        seed_(context.upload_real(std::array{0.999, 0.001}, Precision::single)),
        sums_(context.allocate_real(kItems, Precision::single)) {}

  void launch() {
    constexpr std::int32_t kRounds = 10'000;
    context_.launch(kernel_, {{kItems, 1, 1}}, {seed_, kRounds, sums_}, device::kNotCounted);
  }

 private:
  static constexpr std::size_t kItems = 256;
  device::Context& context_;
  device::Kernel kernel_;
  device::RealBuffer seed_, sums_;
};

/// The device as one that draws a screen.
DeviceInfo screen() {
  DeviceInfo info = test::shared_device().info();
  info.draws_screen = true;
  return info;
}

}  // namespace

TEST_CASE("a queue holds little work, all of which runs") {
  device::Context context(screen());
  const auto trace = std::make_shared<Trace>();
  context.record(trace);
  Chains chains(context);
  constexpr std::uint64_t kLaunches = 80;
  for (std::uint64_t i = 0; i < kLaunches; ++i) chains.launch();
  const WaitTime before_the_end = context.wait_time();
  context.finish();
  CHECK(context.kernel_times()["fma_chains"].launches == kLaunches);
  const auto longest = std::ranges::max_element(trace->events(), {}, &Trace::Event::length);
  // Of launches that are expected to take more, there is one.
  CHECK(before_the_end.most_queued_seconds <=
        std::max(0.2, 1e-9 * static_cast<double>(longest->length)) * 1.0001);
  CHECK(before_the_end.waits > 1);
}

TEST_CASE("a kernel's first launch is timed, and its next ones are not waited for") {
  device::Context context(test::shared_device().info());
  Chains chains(context);
  // A context's very first launch is waited for in any case, to see whether events carry times.
  const auto any = context.allocate_real(1, Precision::single);
  context.launch(context.kernel("limits.cl", "no_work", {8, Precision::single, {}}), {}, {any},
                 device::kNotCounted);
  context.finish();
  const std::uint64_t waits = context.wait_time().waits;
  chains.launch();
  CHECK(context.wait_time().waits == waits + 1);
  chains.launch();
  chains.launch();
  CHECK(context.wait_time().waits == waits + 1);
  context.finish();
}

TEST_CASE("an evaluation waits for the device once") {
  const int iterations = GENERATE(1, 2);
  const Map map = test::random_map(13, 0.1, 0.6, 61);
  const energy::Samples samples = test::random_samples(150, 62);
  const Device device(std::make_shared<device::Context>(test::shared_device().info()));
  const auto evaluator =
      energy::make_device_evaluator(device, samples, {energy::Loss::distance, iterations, 1.3, 20});
  evaluator->evaluate(map, true);
  const WaitTime before = device.wait_time();
  constexpr std::uint64_t kEvaluations = 5;
  for (std::uint64_t i = 0; i < kEvaluations; ++i) evaluator->evaluate(map, true);
  const WaitTime after = device.wait_time();
  CHECK(after.waits - before.waits == kEvaluations);
  // The map goes there; the gradient's and the energy's terms come back.
  CHECK(after.transfers - before.transfers == 3 * kEvaluations);
}

TEST_CASE("a buffer that the device cannot hold is refused before the device is asked") {
  DeviceInfo info = test::shared_device().info();
  info.largest_allocation = 1000;
  info.global_memory = 2500;
  device::Context context(info);
  const auto held = context.allocate<float>(250);
  const auto is_refused = [&](std::size_t floats) {
    try {
      context.allocate<float>(floats);
      return false;
    } catch (const DeviceError& error) {
      CHECK_THAT(error.what(), ContainsSubstring("too little memory"));
      return device::is_out_of_memory(error);
    }
  };
  CHECK(is_refused(251));
  CHECK_FALSE(is_refused(250));
  const auto more = context.allocate<float>(250);
  CHECK(is_refused(126));
  CHECK_FALSE(is_refused(125));
}

TEST_CASE("points go to a device without room in smaller parts") {
  DeviceInfo info = test::shared_device().info();
  info.largest_allocation = 400'000;
  const auto squares = [](const DeviceInfo& of) {
    device::Context context(of);
    device::PointBatch batch(context,
                             context.kernel("limits.cl", "copy_reals", {1, Precision::dbl, {}}),
                             Precision::dbl, 1, 1);
    std::vector<double> found;
    batch.run<1, 1>(
        200'000, [](std::size_t i) { return std::array{static_cast<double>(i)}; },
        [](const device::PointBatch::Part& part) {
          return device::PartCall{{part.in, 1, device::narrow(part.items), part.out},
                                  device::kNotCounted};
        },
        [&](std::size_t i, const std::array<double, 1>& value) {
          CHECK(i == found.size());
          found.push_back(value[0]);
        });
    return found;
  };
  const auto whole = squares(test::shared_device().info());
  CHECK(whole.size() == 200'000);
  CHECK(whole.back() == 199'999);
  CHECK(squares(info) == whole);
  info.largest_allocation = 7;  // not even one point
  CHECK_THROWS_AS(squares(info), DeviceError);
}
