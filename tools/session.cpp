#include "session.hpp"

#include <fmt/format.h>

#include "device/context.hpp"

namespace qjulia::tools {

Watch Session::watch() {
  return {[this](const Progress& progress) { console.progress(progress); }, interrupts.token()};
}

Device Session::open_device(const std::string& wanted) {
  Device device = Device::choose(wanted);
  console.note("device: " + describe(device.info()));
  return device;
}

void Session::report_kernels(const Device& device) {
  if (!console.verbose()) return;
  for (const auto& [name, time] : device.context().kernel_times()) {
    console.detail(
        fmt::format("kernel {:24} {:7} launches {:9.3f} s", name, time.launches, time.seconds));
  }
}

std::string describe(const DeviceInfo& info) {
  return fmt::format("{}:{} {} {}", info.platform, info.index, to_string(info.kind), info.name);
}

}  // namespace qjulia::tools
