// What the device room does without a device: sources put together, launches sized.

#include <catch2/catch.hpp>

#include "device/launch_pace.hpp"
#include "device/program_source.hpp"
#include "qjulia/error.hpp"

using namespace qjulia;
using device::LaunchPace;

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
  LaunchPace pace(two_units());
  for (int launch = 0; launch < 60; ++launch) {
    pace.learn(pace.work(), kOverhead + pace.work() / work_a_second);
  }
  CHECK(pace.work() / work_a_second == Approx(0.08).epsilon(0.01));
}

TEST_CASE("a small launch tells nothing, a slow one does") {
  LaunchPace pace(two_units());
  const double work = pace.work();
  pace.learn(work / 1000, 0.001);
  CHECK(pace.work() == work);
  pace.learn(work / 4, 0.2);
  CHECK(pace.work() == Approx(work / 2));
}

TEST_CASE("a launch without a time leaves a pace that can be used") {
  LaunchPace pace(two_units());
  const double work = pace.work();
  pace.learn(work, 0);
  CHECK(pace.work() == Approx(2 * work));
}
