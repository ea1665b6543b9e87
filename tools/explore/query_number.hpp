#pragma once
/// Numbers in the address of a request.

#include <fmt/format.h>

#include <cmath>
#include <string_view>

#include "base/text.hpp"
#include "qjulia/error.hpp"

namespace qjulia::explore {

/// @throws InputError for anything else than a finite number
template <class Number>
Number query_number(std::string_view text) {
  const auto value = base::number_in<Number>(text);
  if (value && std::isfinite(static_cast<double>(*value))) return *value;
  throw InputError(fmt::format("'{}' is not a number that is expected here", text));
}

}  // namespace qjulia::explore
