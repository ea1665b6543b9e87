#include "device/quirks.hpp"

namespace qjulia::device {

namespace {

/// GPUs, and llvmpipe, which makes its vectors out of neighbouring work-items.
bool has_lanes_across_work_items(const DeviceInfo& info) {
  return info.kind != DeviceKind::cpu || info.name.find("llvmpipe") != std::string::npos;
}

}  // namespace

int preferred_lane_width(const DeviceInfo& info, Precision precision) {
  if (has_lanes_across_work_items(info)) return 1;
  const bool wide_registers = info.native_float_lanes >= 16;
  return wide_registers && precision == Precision::single ? 16 : 8;
}

std::size_t preferred_group_size(const DeviceInfo& info) {
  return has_lanes_across_work_items(info) ? 64 : 4;
}

}  // namespace qjulia::device
