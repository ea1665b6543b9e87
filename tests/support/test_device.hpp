#pragma once
/// The device that kernels are checked on, and what of it is checked. The environment chooses:
/// QJULIA_TEST_DEVICE      as --device does; without it, the CPU
/// QJULIA_TEST_VARIANTS    lane widths, and `gpu` for the layout of GPUs: "1,gpu"; without it,
///                         "1,8,16,gpu" (wide kernels take some compilers minutes)
/// QJULIA_TEST_SINGLE_ONLY for devices without double precision, that they may pass
/// QJULIA_TEST_FEW_POINTS  for interpreters of kernels: sweeps of a thirty-second of the points

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cstdlib>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "qjulia/device/device.hpp"

namespace qjulia::test {

inline std::optional<Device>& kept_device() {
  static std::optional<Device> device;
  return device;
}

/// One device for a whole program, so that kernels are built once, and PoCL reads its library once.
/// `main` lets it go: when the program's statics are destroyed, those of a driver may be gone
/// already (LLVM's, in Oclgrind).
inline const Device& shared_device() {
  if (!kept_device()) {
    const char* const chosen = std::getenv("QJULIA_TEST_DEVICE");
    kept_device() = Device::choose({chosen == nullptr ? "cpu" : chosen});
  }
  return *kept_device();
}

/// A way to cut work into work-items that kernels are checked in: a lane width in the device's own
/// layout, or the layout of GPUs with its width.
struct Variant {
  std::string name;  ///< of the environment's list
  bool is_gpu() const { return name == "gpu"; }
  int width() const { return is_gpu() ? 1 : std::stoi(name); }
  Device of(const Device& device) const {
    return is_gpu() ? device.with_layout(Layout::gpu) : device.with_lane_width(width());
  }
};

inline std::ostream& operator<<(std::ostream& out, const Variant& variant) {
  return out << variant.name;
}

/// For kernels that the settings of a layout reach.
inline std::vector<Variant> variants() {
  const char* const chosen = std::getenv("QJULIA_TEST_VARIANTS");
  std::istringstream list(chosen == nullptr ? "1,8,16,gpu" : chosen);
  std::vector<Variant> found;
  for (std::string name; std::getline(list, name, ',');) found.push_back({name});
  if (found.empty()) throw std::runtime_error("QJULIA_TEST_VARIANTS is empty");
  return found;
}

/// For kernels that know nothing of a layout but its lane width.
inline std::vector<int> lane_widths() {
  std::vector<int> widths;
  for (const Variant& variant : variants()) {
    const bool is_new = std::ranges::find(widths, variant.width()) == widths.end();
    if (is_new) widths.push_back(variant.width());
  }
  return widths;
}

/// How many points of a sweep are checked. @param usual a multiple of 512
inline std::size_t sweep_size(std::size_t usual) {
  constexpr std::size_t kFewer = 32;
  return std::getenv("QJULIA_TEST_FEW_POINTS") == nullptr ? usual : usual / kFewer;
}

/// Whether `precision` can be checked on the device. Where it cannot, the test says so if the
/// environment has QJULIA_TEST_SINGLE_ONLY, and fails if not.
inline bool can_check(const Device& device, Precision precision) {
  if (precision == Precision::single || device.info().has_double) return true;
  if (std::getenv("QJULIA_TEST_SINGLE_ONLY") == nullptr) {
    FAIL("'" << device.info().name << "' has no double precision, and this run expects it");
  }
  WARN("'" << device.info().name << "' has no double precision: not checked");
  return false;
}

/// Whether tests that go through every kind of map run in this width and precision. Double
/// precision runs only with eight lanes, the default of CPUs (without them, in the first width),
/// because each program takes seconds to compile. test_field checks the plain kind in all widths.
inline bool checks_every_kind(int width, Precision precision) {
  constexpr int kUsual = 8;
  if (precision == Precision::single) return true;
  const std::vector<int> widths = lane_widths();
  return width == (std::ranges::count(widths, kUsual) > 0 ? kUsual : widths.front());
}
/// The same, and the layout of GPUs in both precisions.
inline bool checks_every_kind(const Variant& variant, Precision precision) {
  return variant.is_gpu() || checks_every_kind(variant.width(), precision);
}

}  // namespace qjulia::test
