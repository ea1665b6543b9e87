#pragma once
/// One run of the command: what it says, when it is to stop, how long it has run.

#include <chrono>
#include <string>

#include "console.hpp"
#include "interrupts.hpp"
#include "qjulia/device.hpp"

namespace qjulia::tools {

class Session {
 public:
  explicit Session(const Verbosity& verbosity) : console(verbosity) {}

  /// Wall time since the command started.
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }
  /// Progress to the console, stop requests from signals. Valid as long as this session.
  Watch watch();
  /// Chooses a device and says which. @throws NoDeviceError
  Device open_device(const std::string& wanted);
  /// With --verbose: how long each kernel ran on the device.
  void report_kernels(const Device& device);

  // The signals are blocked before anything can start a thread.
  Interrupts interrupts;
  Console console;

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// "0:0 cpu NAME".
std::string describe(const DeviceInfo& info);

}  // namespace qjulia::tools
