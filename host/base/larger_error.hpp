#pragma once
#include <cmath>

namespace qjulia::base {

/// The larger of two errors, where an error that is not a number is the largest.
inline double larger_error(double a, double b) { return std::isnan(a) || a >= b ? a : b; }

}  // namespace qjulia::base
