#include "device/quirks.hpp"

#include <algorithm>
#include <bit>
#include <charconv>

namespace qjulia::device {

bool is_pocl(const DeviceInfo& info) { return info.platform_name == "Portable Computing Language"; }

bool is_llvmpipe(const DeviceInfo& info) { return info.name.find("llvmpipe") != std::string::npos; }

unsigned float_lanes(DeviceKind kind, unsigned said) {
#if defined(__aarch64__) || defined(__x86_64__)
  constexpr unsigned kLeast = 4;  // NEON and SSE2, which all of these CPUs have
#else
  constexpr unsigned kLeast = 1;
#endif
  return kind == DeviceKind::cpu ? std::max(said, kLeast) : said;
}

namespace {

int preferred_lane_width(const DeviceInfo& info, Precision precision, Layout layout) {
  if (layout == Layout::gpu || is_llvmpipe(info)) return 1;
  const bool wide_registers = info.native_float_lanes >= 16;
  return wide_registers && precision == Precision::single ? 16 : 8;
}

/// Work-items that sum together in local memory.
constexpr std::size_t kOrbitGroup = 64;
/// Side of the square of work-items that share tiles.
constexpr std::size_t kProductSide = 16;

}  // namespace

Layout suited_layout(const DeviceInfo& info) {
  // llvmpipe's groups are as slow as its memory, so that it sums privately.
  return info.kind == DeviceKind::cpu || is_llvmpipe(info) ? Layout::cpu : Layout::gpu;
}

bool may_miscompile_barriers(const DeviceInfo& info) {
  constexpr int kFirst = 5;
  int major = 0;
  const std::string& version = info.driver_version;
  std::from_chars(version.data(), version.data() + version.size(), major);
  return is_pocl(info) && info.kind == DeviceKind::cpu && major >= kFirst;
}

bool has_barriers(const Tuning& tuning) {
  return tuning.orbit_group > 1 || tuning.product_side > 1;
}

Tuning default_tuning(const DeviceInfo& info, Precision precision, Layout layout, int lane_width) {
  const int width = lane_width != 0 ? lane_width : preferred_lane_width(info, precision, layout);
  Tuning tuning{.lane_width = width,
                .energy_vectors = width == 1 ? 1 : 4,
                .gradient_rows = 64,
                // Privately, gradient_orbit keeps 5 K lane sums an item: few items on wide lanes.
                .orbit_items = layout == Layout::gpu ? 1024
                               : width == 1          ? 8192
                                                     : 64,
                .panel_samples = 1024,  // two tiles of them fit a core's cache
                .panel_block = 64};
  if (layout == Layout::gpu && width == 1 && !may_miscompile_barriers(info)) {
    tuning.orbit_group = static_cast<int>(
        std::bit_floor(std::clamp<std::size_t>(info.largest_work_group, 1, kOrbitGroup)));
    if (info.largest_work_group >= kProductSide * kProductSide) {
      tuning.product_side = static_cast<int>(kProductSide);
    }
  }
  return tuning;
}

bool needs_kernels_of_its_own(const DeviceInfo& info) { return is_pocl(info); }

std::string source_for(const DeviceInfo& info, const std::string& source) {
  if (!is_pocl(info) || info.opencl_version.find("-aarch64-") == std::string::npos) return source;
  // Those that Debian's PoCL 3.1 names, whose compiler is asked for atomics by calls.
  return "#pragma clang attribute push(__attribute__((target(\"neon,outline-atomics,v8a\"))), "
         "apply_to = function)\n#line 1\n" +
         source + "\n#pragma clang attribute pop\n";
}

bool compiles_on_disk(const DeviceInfo& info) { return is_pocl(info); }

bool gains_by_stored_programs(const DeviceInfo& info) { return info.kind != DeviceKind::cpu; }

bool cuts_long_loops(const DeviceInfo& info) { return is_llvmpipe(info); }

std::size_t share_of_lane(const DeviceInfo& info, std::size_t usual) {
  return cuts_long_loops(info) ? 1 : usual;
}

bool may_crash_in_builds(const DeviceInfo& info) { return info.kind != DeviceKind::cpu; }

std::size_t preferred_group_size(const DeviceInfo& info, int lane_width) {
  const bool has_wide_lanes = lane_width > 1 && suited_layout(info) == Layout::cpu;
  const std::size_t most = std::max<std::size_t>(info.largest_work_group, 1);
  return std::min<std::size_t>(has_wide_lanes ? 4 : 64, std::bit_floor(most));
}

}  // namespace qjulia::device
