#include "device/quirks.hpp"

namespace qjulia::device {

int preferred_lane_width(const DeviceInfo& info, Precision precision) {
  const bool across_work_items = info.name.find("llvmpipe") != std::string::npos;
  if (info.kind != DeviceKind::cpu || across_work_items) return 1;
  const bool wide_registers = info.native_float_lanes >= 16;
  return wide_registers && precision == Precision::single ? 16 : 8;
}

}  // namespace qjulia::device
