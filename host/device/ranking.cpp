#include "device/ranking.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <tuple>

#include "base/text.hpp"
#include "device/quirks.hpp"

namespace qjulia::device {
namespace {

bool has(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }

/// Multiply-adds per clock of one compute unit, as its vendor counts units.
double lanes_of_unit(const DeviceInfo& info) {
  if (info.kind == DeviceKind::cpu) return info.native_float_lanes;
  const std::string vendor = base::lower_case(info.vendor + ' ' + info.name);
  if (has(vendor, "nvidia")) return 128;  // a multiprocessor
  if (has(vendor, "advanced micro devices") || has(vendor, "amd")) return 64;
  if (has(vendor, "apple")) return 128;  // a core
  if (has(vendor, "intel")) return 8;    // an execution unit or vector engine
  return 32;
}

/// Devices of a lower class are used first.
int class_of(const DeviceInfo& info) {
  // Mesa's CPU device takes several times as long as other CPU drivers; sometimes it says that it
  // is a GPU.
  if (is_llvmpipe(info)) return 4;
  switch (info.kind) {
    case DeviceKind::gpu:
      return info.shares_memory ? 1 : 0;
    case DeviceKind::accelerator:
    case DeviceKind::other:
      return 2;
    case DeviceKind::cpu:
      break;
  }
  return 3;
}

/// Platforms of a lower class are preferred for a GPU that several platforms show.
int platform_class(const DeviceInfo& info) {
  const std::string name = base::lower_case(info.platform_name);
  if (has(name, "clover")) return 3;
  if (has(name, "portable computing language")) return 2;
  return has(name, "rusticl") ? 1 : 0;
}

/// The number behind "OpenCL ", such as 3.0.
double opencl_number(const DeviceInfo& info) {
  const auto words = base::split(info.opencl_version, ' ');
  return words.size() < 2 ? 0 : base::number_in<double>(words[1]).value_or(0);
}

bool is_same_hardware(const DeviceInfo& a, const DeviceInfo& b) {
  const auto same = [](const std::string& x, const std::string& y) { return !x.empty() && x == y; };
  // Parts of one GPU are devices of one platform.
  return a.platform != b.platform && (same(a.pci_address, b.pci_address) || same(a.uuid, b.uuid));
}

bool serves_better(const DeviceInfo& a, const DeviceInfo& b) {
  const auto key = [](const DeviceInfo& info) {
    return std::tuple(platform_class(info), !info.has_double, -opencl_number(info), info.platform,
                      info.index);
  };
  return key(a) < key(b);
}

}  // namespace

double estimated_speed(const DeviceInfo& info) {
  constexpr double kUnknownClock = 1000;  // MHz; some drivers say 0
  const double clock = info.clock_mhz == 0 ? kUnknownClock : info.clock_mhz;
  return 1e-3 * info.compute_units * clock * lanes_of_unit(info);
}

void mark_same_hardware(std::vector<DeviceInfo>& devices) {
  for (DeviceInfo& info : devices) {
    const DeviceInfo* best = &info;
    for (const DeviceInfo& other : devices) {
      if (is_same_hardware(info, other) && serves_better(other, *best)) best = &other;
    }
    info.same_as = best == &info ? "" : device_id(*best);
  }
}

void rank_devices(std::vector<DeviceInfo>& devices) {
  // Platforms may disagree on whether a GPU shares the host's memory: what is used of them says so.
  const auto used_for = [&](const DeviceInfo& info) -> const DeviceInfo& {
    const auto same = std::ranges::find(devices, info.same_as, device_id);
    return same == devices.end() ? info : *same;
  };
  std::vector<std::size_t> order(devices.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) {
    const DeviceInfo& info = devices[i];
    return std::tuple(class_of(used_for(info)), !info.same_as.empty(), -info.estimated_speed);
  });
  for (std::size_t i = 0; i < order.size(); ++i) devices[order[i]].rank = static_cast<int>(i) + 1;
}

std::string device_id(const DeviceInfo& info) {
  return fmt::format("{}:{}", info.platform, info.index);
}

}  // namespace qjulia::device
