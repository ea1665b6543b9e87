#pragma once
/// The device that kernels are checked on, and what of it is checked. The environment chooses:
/// QJULIA_TEST_DEVICE      as --device does; without it, the CPU
/// QJULIA_TEST_WIDTHS      lane widths, "1,8"; without it, 1, 8 and 16 (wide kernels take some
///                         compilers minutes)
/// QJULIA_TEST_SINGLE_ONLY for devices without double precision, that they may pass

#include <catch2/catch.hpp>
#include <cstdlib>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "qjulia/device.hpp"

namespace qjulia::test {

inline Device device() {
  const char* const chosen = std::getenv("QJULIA_TEST_DEVICE");
  return Device::choose(chosen == nullptr ? "cpu" : chosen);
}

inline std::optional<Device>& kept_device() {
  static std::optional<Device> device;
  return device;
}

/// One device for a whole program, so that kernels are built once. `main` lets it go: when the
/// program's statics are destroyed, those of a driver may be gone already (LLVM's, in Oclgrind).
inline const Device& shared_device() {
  if (!kept_device()) kept_device() = device();
  return *kept_device();
}

inline std::vector<int> lane_widths() {
  const char* const chosen = std::getenv("QJULIA_TEST_WIDTHS");
  if (chosen == nullptr) return {1, 8, 16};
  std::vector<int> widths;
  std::istringstream list(chosen);
  for (std::string width; std::getline(list, width, ',');) widths.push_back(std::stoi(width));
  if (widths.empty()) throw std::runtime_error("QJULIA_TEST_WIDTHS is empty");
  return widths;
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

}  // namespace qjulia::test
