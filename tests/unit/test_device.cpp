// What the device room does without a device: sources put together, launches sized.

#include <catch2/catch.hpp>

#include "device/launch_sizer.hpp"
#include "device/program_source.hpp"
#include "qjulia/error.hpp"

using namespace qjulia;
using device::LaunchSizer;

namespace {

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

DeviceInfo two_units() {
  DeviceInfo info;
  info.compute_units = 2;
  return info;
}

}  // namespace

TEST_CASE("an include by name takes the file given, else the source's own") {
  const std::string plain = device::expand_kernel_source("field.cl");
  CHECK(has(plain, "kernels/factors_modulus.clh"));
  CHECK(has(plain, "kernels/factors_versor.clh"));
  CHECK_FALSE(has(plain, "kernels/quadratic_modulus.clh"));
  const std::string other =
      device::expand_kernel_source("field.cl", {{"QJ_MODULUS", "quadratic_modulus.clh"}});
  CHECK(has(other, "kernels/quadratic_modulus.clh"));
  CHECK(has(other, "kernels/factors_versor.clh"));
  CHECK_FALSE(has(other, "kernels/factors_modulus.clh"));
  CHECK_THROWS_AS(device::expand_kernel_source("field.cl", {{"QJ_MODULUS", "none.clh"}}),
                  KernelBuildError);
}

TEST_CASE("launches come to take 80 ms") {
  const double work_a_second = GENERATE(1e6, 1e9, 1e13);
  constexpr double kOverhead = 50e-6;
  LaunchSizer sizer(two_units());
  for (int launch = 0; launch < 60; ++launch) {
    sizer.learn(sizer.work(), kOverhead + sizer.work() / work_a_second);
  }
  CHECK(sizer.work() / work_a_second == Approx(0.08).epsilon(0.01));
}

TEST_CASE("a small launch tells nothing, a slow one does") {
  LaunchSizer sizer(two_units());
  const double work = sizer.work();
  sizer.learn(work / 1000, 0.001);
  CHECK(sizer.work() == work);
  sizer.learn(work / 4, 0.2);
  CHECK(sizer.work() == Approx(work / 2));
}

TEST_CASE("a launch without a time leaves a sizer that can be used") {
  LaunchSizer sizer(two_units());
  const double work = sizer.work();
  sizer.learn(work, 0);
  CHECK(sizer.work() == Approx(2 * work));
}
