#pragma once
/// Numbers in the address of a request.

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <string_view>
#include <type_traits>

#include "qjulia/error.hpp"

namespace qjulia::explore {

/// @throws InputError for anything else than a finite number
template <class Number>
Number query_number(std::string_view text) {
  Number value{};
  const char* const end = text.data() + text.size();
  const auto [stopped, code] = std::from_chars(text.data(), end, value);
  bool is_finite = true;
  if constexpr (std::is_floating_point_v<Number>) is_finite = std::isfinite(value);
  if (code == std::errc{} && stopped == end && is_finite) return value;
  throw InputError(fmt::format("'{}' is not a number that is expected here", text));
}

}  // namespace qjulia::explore
