#include "device/quirks.hpp"

namespace qjulia::device {

namespace {

bool is_llvmpipe(const DeviceInfo& info) { return info.name.find("llvmpipe") != std::string::npos; }

/// GPUs, and llvmpipe, which makes its vectors out of neighbouring work-items.
bool has_lanes_across_work_items(const DeviceInfo& info) {
  return info.kind != DeviceKind::cpu || is_llvmpipe(info);
}

int preferred_lane_width(const DeviceInfo& info, Precision precision) {
  if (has_lanes_across_work_items(info)) return 1;
  const bool wide_registers = info.native_float_lanes >= 16;
  return wide_registers && precision == Precision::single ? 16 : 8;
}

}  // namespace

Tuning default_tuning(const DeviceInfo& info, Precision precision, int lane_width) {
  Tuning tuning;
  tuning.lane_width = lane_width != 0 ? lane_width : preferred_lane_width(info, precision);
  tuning.energy_vectors = tuning.lane_width == 1 ? 1 : 4;
  tuning.gradient_rows = 64;
  // Privately, gradient_orbit keeps 5 K lane sums an item: few items on wide lanes. On GPUs groups
  // share theirs; llvmpipe's groups are as slow as its memory.
  const bool is_gpu = info.kind == DeviceKind::gpu && !is_llvmpipe(info);
  tuning.orbit_group = is_gpu && tuning.lane_width == 1 ? 64 : 1;
  tuning.orbit_items = is_gpu ? 1024 : tuning.lane_width == 1 ? 8192 : 64;
  tuning.product_side = tuning.orbit_group > 1 ? 16 : 1;
  tuning.panel_samples = 1024;  // two tiles of them fit a core's cache
  tuning.panel_block = 64;
  return tuning;
}

std::size_t preferred_group_size(const DeviceInfo& info) {
  return has_lanes_across_work_items(info) ? 64 : 4;
}

}  // namespace qjulia::device
