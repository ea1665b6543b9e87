#pragma once
/// Sees every launch of this process, so that the work of kernels can be counted beside their time.

#include <cstddef>
#include <cstring>
#include <functional>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "device/context.hpp"
#include "qjulia/device/kernel_resources.hpp"

namespace qjulia::device {

/// A kernel as it is put in the queue.
struct Launch {
  std::string_view kernel;
  const Range& range;
  std::span<const std::span<const std::byte>> arguments;  ///< bytes of scalars; empty for buffers
  int lane_width;
  Precision precision;
  const std::function<KernelResources()>& resources;  ///< asks the driver

  /// The argument of that number, which is an int.
  int integer(std::size_t number) const { return as<std::int32_t>(number); }
  /// The argument of that number, a struct or scalar of that type.
  template <class Struct>
  Struct as(std::size_t number) const {
    Struct value{};
    const auto bytes = arguments[number];
    if (bytes.size() != sizeof value) throw std::logic_error("a launch's argument of another type");
    std::memcpy(&value, bytes.data(), sizeof value);
    return value;
  }
};

/// Work that only who launches knows, because the kernel's way depends on its data.
struct WalkedWork {
  double slots = 0;    ///< multiply-adds and the like
  double fields = 0;   ///< F of one factor at one point
  double versors = 0;  ///< the same of versors
};

class LaunchWatch {
 public:
  virtual ~LaunchWatch() = default;
  /// Called by whichever thread launches.
  virtual void launched(const Launch& launch) = 0;
  virtual void did(std::string_view kernel, const WalkedWork& work) = 0;
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
