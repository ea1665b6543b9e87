#pragma once
/// The CPU, for commands that see it as a GPU.

#include <fmt/format.h>

#include <string>

#include "qjulia/device/device.hpp"

namespace qjulia::test {

/// As `--device` takes it: PLATFORM:DEVICE. Drivers give the CPU different names.
inline const std::string& cpu_id() {
  static const std::string id = [] {
    const DeviceInfo cpu = Device::choose({"cpu"}).info();
    return fmt::format("{}:{}", cpu.platform, cpu.index);
  }();
  return id;
}

}  // namespace qjulia::test
