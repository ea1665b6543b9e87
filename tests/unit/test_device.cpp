// What the device room does without a device: sources put together, launches sized, waits slept
// through, errors named.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <thread>

#include "device/error_names.hpp"
#include "device/launch_sizer.hpp"
#include "device/patient_wait.hpp"
#include "device/program_source.hpp"
#include "device/quirks.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/device/device.hpp"

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

TEST_CASE("launches come to take 80 ms, and the first is short") {
  const double work_a_second = GENERATE(1e6, 1e9, 1e13);
  constexpr double kOverhead = 50e-6;
  LaunchSizer sizer(two_units());
  CHECK(sizer.work() <= 1e7);  // what a slow CPU does in 10 ms
  for (int launch = 0; launch < 60; ++launch) {
    sizer.learn(sizer.work(), kOverhead + sizer.work() / work_a_second);
  }
  CHECK(sizer.work() / work_a_second == Catch::Approx(0.08).epsilon(0.01));
}

TEST_CASE(
    "the first time of a kernel changes its launches at once, further ones little by little") {
  LaunchSizer slow(two_units()), fast(two_units());
  const double work = slow.work();
  slow.learn(work, 1.6);
  CHECK(slow.work() == Catch::Approx(work / 20));
  fast.learn(work, 0.005);
  CHECK(fast.work() == Catch::Approx(16 * work));
  fast.learn(16 * work, 0.005);
  CHECK(fast.work() == Catch::Approx(32 * work));
}

TEST_CASE("a small launch tells nothing, a slow one does") {
  LaunchSizer sizer(two_units());
  const double work = sizer.work();
  sizer.learn(work / 1000, 0.001);
  CHECK(sizer.work() == work);
  sizer.learn(work / 4, 0.2);
  CHECK(sizer.work() == Catch::Approx(work / 10));
  sizer.learn(work / 10, 1);
  CHECK(sizer.work() == Catch::Approx(work / 20));
}

TEST_CASE("a launch without a time leaves a sizer that can be used") {
  LaunchSizer sizer(two_units());
  const double work = sizer.work();
  sizer.learn(work, 0);
  CHECK(sizer.work() == Catch::Approx(32 * work));
}

TEST_CASE("errors have OpenCL's names, and lost devices are known by them") {
  CHECK(device::named_error(-5) == "CL_OUT_OF_RESOURCES (-5)");
  CHECK(device::named_error(-36) == "CL_INVALID_COMMAND_QUEUE (-36)");
  CHECK(device::named_error(-1001) == "CL_PLATFORM_NOT_FOUND_KHR (-1001)");
  CHECK(has(device::named_error(-9999), "NVIDIA"));
  CHECK(device::named_error(-5000) == "OpenCL error (-5000)");
  for (int code = -1; code >= -72; --code) {
    if (code < -19 && code > -30) continue;  // OpenCL has no such
    CAPTURE(code);
    CHECK(has(device::named_error(code), "CL_"));
  }
  for (const int code : {-36, -9999, -2}) {
    CHECK(DeviceError("a GPU", "clFinish", code).is_lost());
    CHECK(has(DeviceError("a GPU", "clFinish", code).what(), "the driver has lost the device"));
  }
  for (const int code : {-4, -5, -54}) CHECK_FALSE(DeviceError("a GPU", "x", code).is_lost());
}

namespace {

/// Waits until a time, asleep or not.
int wait_until(device::PatientWait::Clock::time_point end, bool is_busy) {
  if (!is_busy) std::this_thread::sleep_until(end);
  while (device::PatientWait::Clock::now() < end) {
  }
  return 7;
}

/// How often a wait of 3 ms that is expected slept before, of ten. So short a wait often fits into
/// one turn that a busy machine gives a thread, which then looks as busy as it is. Times are
/// compared with those of calls within them, which hold however late the thread gets its turns.
int sleeps(bool may_sleep, bool is_busy) {
  using Clock = device::PatientWait::Clock;
  constexpr auto kWait = std::chrono::milliseconds(3);
  const auto seconds = [](Clock::duration time) {
    return std::chrono::duration<double>(time).count();
  };
  double waited = 0, to_sleep = 0;
  const auto total = std::make_shared<device::WaitTotal>();
  device::PatientWait wait(may_sleep, total);
  int flushes = 0;
  for (int i = 0; i < 10; ++i) {
    const auto end = Clock::now() + kWait;
    wait.expect(seconds(kWait));
    const auto flush = [&] {
      ++flushes;
      to_sleep += 0.75 * std::max(0.0, seconds(end - Clock::now()));
    };
    const auto wait_to_end = [&] {
      const auto begin = Clock::now();
      const int result = wait_until(end, is_busy);
      waited += seconds(Clock::now() - begin);
      return result;
    };
    CHECK(wait(flush, wait_to_end) == 7);
  }
  CHECK(total->value().seconds >= waited + to_sleep);
  CHECK(total->value().slept_seconds >= to_sleep);
  return flushes;
}

}  // namespace

TEST_CASE("a driver that keeps a core busy is called after a sleep, others at once") {
  // All but the first and none, if nobody disturbs; a thread that gets little of a core does not
  // look busy, and one that is woken late may.
  int slept = 0;
  for (int tries = 0; tries < 20 && slept == 0; ++tries) {
    slept = sleeps(/*may_sleep=*/true, /*is_busy=*/true);
  }
  CHECK(slept >= 1);
  CHECK(sleeps(/*may_sleep=*/true, /*is_busy=*/false) < 5);
  CHECK(sleeps(/*may_sleep=*/false, /*is_busy=*/true) == 0);
}

TEST_CASE("launches are expected to take at least the least that they took, at most the most") {
  device::LaunchTime time;
  CHECK_FALSE(time.is_known());
  CHECK(time.least(1000) == 0);
  CHECK(time.most(1000) == 0);
  time.learn(1000, 0.1);
  CHECK(time.is_known());
  CHECK(time.least(2000) == Catch::Approx(0.2));
  CHECK(time.most(2000) == Catch::Approx(0.2));
  time.learn(1000, 0.01);
  CHECK(time.least(1000) == Catch::Approx(0.01));
  CHECK(time.most(1000) == Catch::Approx(0.055));
  time.learn(1000, 0.1);
  CHECK(time.least(1000) == Catch::Approx(0.055));
  CHECK(time.most(1000) == Catch::Approx(0.1));
  time.learn(0, 5);
  time.learn(1000, 0);
  CHECK(time.least(1000) == Catch::Approx(0.055));
  CHECK(time.most(1000) == Catch::Approx(0.1));
}

TEST_CASE("a wait for a part of the queue is slept for as long as that part is expected to take") {
  const auto total = std::make_shared<device::WaitTotal>();
  device::PatientWait wait(/*may_sleep=*/true, total);
  const auto busily = [&](double expected, int milliseconds, double left) {
    wait.expect(expected);
    const auto end = device::PatientWait::Clock::now() + std::chrono::milliseconds(milliseconds);
    return wait([] {}, [&] { return wait_until(end, true); }, left);
  };
  do {
    busily(0.02, 20, 0);  // the driver is seen to be busy, if nobody disturbs
  } while (!wait.spins());
  const double slept = total->value().slept_seconds;
  const std::uint64_t waits = total->value().waits;
  // 12 of 20 s are left in the queue, so that three quarters of 8 ms are slept.
  wait.expect(0.008 + 12);
  wait([] {}, [] { return 0; }, 12);
  CHECK(total->value().slept_seconds - slept >= 0.004);
  CHECK(total->value().slept_seconds - slept < 1);
  CHECK(total->value().waits == waits + 1);
}

TEST_CASE("a device that cuts long loops gets little to do in each, and a warning") {
  DeviceInfo info;
  info.name = "llvmpipe (LLVM 15.0.6, 256 bits)";
  CHECK(device::share_of_lane(info, 32) == 1);
  CHECK_THAT(known_fault(info), Catch::Matchers::ContainsSubstring("65,535 turns"));
  info.name = "pthread-skylake-avx512";
  CHECK(device::share_of_lane(info, 32) == 32);
  CHECK(known_fault(info).empty());
}
