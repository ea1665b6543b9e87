#pragma once
/// What the processor does in each kernel, and what the kernel needs of the device.

#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "device/launch_watch.hpp"
#include "profile/process_events.hpp"

namespace qjulia::profiling {

/// Events by their names.
using EventCounts = std::map<std::string, double>;

/// Watches launches one at a time, each until it has ended.
class KernelCounter final : public device::LaunchWatch {
 public:
  /// @param events null: only what kernels need is asked.
  explicit KernelCounter(ProcessEvents* events) : events_(events) {}

  void launched(const device::Launch& launch) override;
  void did(std::string_view /*kernel*/, double /*slots*/) override {}
  std::shared_ptr<void> alone(std::string_view kernel) override;

  struct Kernel {
    EventCounts events;  ///< of all launches since the reset
    KernelResources resources;
  };
  std::map<std::string, Kernel, std::less<>> kernels() const;
  /// Forgets the events.
  void reset();

 private:
  class Alone;
  ProcessEvents* events_;
  std::mutex running_;          ///< kernels of several queues would be counted twice
  mutable std::mutex keeping_;  ///< guards kernels_
  std::map<std::string, Kernel, std::less<>> kernels_;
};

}  // namespace qjulia::profiling
