// Cost against size, measured small.

#include <catch2/catch_all.hpp>
#include <cmath>

#include "device/context.hpp"
#include "qjulia/profile/scaling.hpp"
#include "test_device.hpp"

using namespace qjulia;

TEST_CASE("time grows with size, memory with samples and factors apart") {
  ScalingOptions options;
  options.samples = {16'000, 128'000};
  options.factors = {64, 512};
  options.most_slots = 1e10;
  const ScalingReport report = measure_scaling(test::shared_device(), options);
  // At n = 4 the largest is left out.
  REQUIRE(report.points.size() == 7);
  REQUIRE(report.laws.size() == 2);
  for (const ScalingLaw& law : report.laws) {
    // Other programs change times; test_scaling.cpp of the unit tests has laws of known times.
    CHECK(std::isfinite(law.samples_exponent));
    CHECK(std::isfinite(law.factors_exponent));
  }
  const auto bytes = [&](std::size_t i) {
    return static_cast<double>(report.points[i].device_bytes);
  };
  // Six arrays of samples, field and cotangent, at the least.
  CHECK(bytes(0) >= 16'000 * 8 * 4);
  CHECK(bytes(3) >= 128'000 * 8 * 4);
  // A product of the sizes would make this 64 times as much.
  CHECK(bytes(3) < 10 * bytes(0));
  CHECK(bytes(3) - bytes(2) == Catch::Approx(bytes(1) - bytes(0)).epsilon(0.05));
}

TEST_CASE("buffers are counted while they live") {
  const Device device = test::shared_device();
  device::Context& context = device.context();
  context.reset_peak_allocated_bytes();
  const std::size_t before = context.peak_allocated_bytes();
  {
    const auto a = context.allocate<float>(1000);
    { const auto b = context.allocate<float>(500); }
    const auto c = context.allocate<float>(200);
    CHECK(context.peak_allocated_bytes() == before + 6000);
  }
  context.reset_peak_allocated_bytes();
  CHECK(context.peak_allocated_bytes() == before);
}
