#pragma once
/// A device as Python holds it: one thread at a time may use it, and others wait.

#include <pybind11/pybind11.h>

#include <chrono>
#include <memory>
#include <mutex>

#include "qjulia/device/device.hpp"

namespace qjulia::python {

/// How often Python is asked whether there was a signal.
constexpr std::chrono::milliseconds kBetweenLooks{50};

struct OpenDevice {
  Device device;
  /// Of this device and its copies. A callback may use the device that its caller holds.
  std::shared_ptr<std::recursive_timed_mutex> in_use =
      std::make_shared<std::recursive_timed_mutex>();
};

/// Has the device for the calling thread while it lives. Waits without Python's lock, and looks for
/// Ctrl-C meanwhile. To be made with Python's lock.
class DeviceUse {
 public:
  explicit DeviceUse(const OpenDevice& device);
  ~DeviceUse() { in_use_->unlock(); }
  DeviceUse(const DeviceUse&) = delete;
  DeviceUse& operator=(const DeviceUse&) = delete;

 private:
  std::shared_ptr<std::recursive_timed_mutex> in_use_;
};

void add_device(pybind11::module_& module);

}  // namespace qjulia::python
