#pragma once
/// Tests of double precision, on devices without it.

#include <catch2/catch.hpp>
#include <cstdlib>

#include "qjulia/device.hpp"

namespace qjulia::test {

/// Whether `precision` can be checked on the device. Where it cannot, the test says so if the
/// environment has QJULIA_TEST_SINGLE_ONLY (runs on other devices), and fails if not.
inline bool can_check(const Device& device, Precision precision) {
  if (precision == Precision::single || device.info().has_double) return true;
  if (std::getenv("QJULIA_TEST_SINGLE_ONLY") == nullptr) {
    FAIL("'" << device.info().name << "' has no double precision, and this run expects it");
  }
  WARN("'" << device.info().name << "' has no double precision: not checked");
  return false;
}

}  // namespace qjulia::test
