#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace qjulia::base {

/// The value in the middle; of an even number, the higher of two. @param values at least one.
inline double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

}  // namespace qjulia::base
