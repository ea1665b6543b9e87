#pragma once
/// Times what is launched on a device.

#include <chrono>
#include <functional>

#include "device/context.hpp"
#include "qjulia/device.hpp"

namespace qjulia::profiling {

struct KernelSeconds {
  double device = 0;  ///< sum over all kernels that ran
  double wall = 0;
};

/// Runs `work` and waits for the device.
inline KernelSeconds timed(const Device& device, const std::function<void()>& work) {
  device::Context& context = device.context();
  context.reset_kernel_times();
  const auto start = std::chrono::steady_clock::now();
  work();
  context.finish();
  KernelSeconds seconds;
  seconds.wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  for (const auto& [name, time] : context.kernel_times()) seconds.device += time.seconds;
  return seconds;
}

}  // namespace qjulia::profiling
