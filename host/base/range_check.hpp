#pragma once
/// Checks of options, all with one kind of error and in the same words.

#include <fmt/format.h>

#include <cmath>
#include <string_view>
#include <type_traits>

#include "qjulia/base/error.hpp"

namespace qjulia::base {

/// @throws OptionError unless low <= value <= high; NaN never is.
template <class Number>
void expect_between(const char* field, Number value, std::type_identity_t<Number> low,
                    std::type_identity_t<Number> high, std::string_view unit = {}) {
  if (value >= low && value <= high) return;
  throw OptionError(field, fmt::format("{} is out of range; give {} to {}{}{}", value, low, high,
                                       unit.empty() ? "" : " ", unit));
}

/// @throws OptionError unless the value is finite and above 0.
inline void expect_positive(const char* field, double value) {
  if (value > 0 && std::isfinite(value)) return;
  throw OptionError(field, fmt::format("{} is out of range; give a positive number", value));
}

/// @throws OptionError unless the value is finite.
inline void expect_finite(const char* field, double value) {
  if (!std::isfinite(value)) throw OptionError(field, fmt::format("{} is not a number", value));
}

}  // namespace qjulia::base
