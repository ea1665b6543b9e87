#pragma once
/// Sees every launch of this process, so that the work of kernels can be counted beside their time.

#include <functional>
#include <memory>
#include <string_view>

#include "device/context.hpp"
#include "qjulia/device/kernel_resources.hpp"

namespace qjulia::device {

/// A kernel as it is put in the queue.
struct Launch {
  std::string_view kernel;
  LaunchWork work;
  Precision precision;
  const std::function<KernelResources()>& resources;  ///< asks the driver
};

class LaunchWatch {
 public:
  virtual ~LaunchWatch() = default;
  /// Called by whichever thread launches.
  virtual void launched(const Launch& launch) = 0;
  /// Slots beyond what launches of the kernel said: its way depends on its data.
  virtual void did(std::string_view kernel, double slots) = 0;
  /// What lives while a kernel runs by itself: each launch is then waited for. Null: none is.
  virtual std::shared_ptr<void> alone(std::string_view /*kernel*/) { return nullptr; }
};

/// The one that watches now; null: none does.
LaunchWatch* launch_watch();

/// Lets one watch while this lives. Launches must have ended when it is destroyed.
class WatchedLaunches {
 public:
  explicit WatchedLaunches(LaunchWatch& watch);
  ~WatchedLaunches();
  WatchedLaunches(const WatchedLaunches&) = delete;
  WatchedLaunches& operator=(const WatchedLaunches&) = delete;

 private:
  LaunchWatch* before_;
};

}  // namespace qjulia::device
