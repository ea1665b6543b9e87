#pragma once
/// The checks of `self_test`, by the room whose kernels they run.

#include <limits>
#include <span>

#include "qjulia/device/device.hpp"

namespace qjulia::check {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

struct Check {
  const char* program;
  const char* compared;
  double in_single, in_double;  ///< tolerances
  double (*difference)(const Device& device, Precision precision);
  bool is_quick = false;  ///< is part of `quick_self_test`
};

std::span<const Check> device_checks();
std::span<const Check> field_checks();
std::span<const Check> energy_checks();
std::span<const Check> shape_checks();
std::span<const Check> surface_checks();
std::span<const Check> picture_checks();

}  // namespace qjulia::check
