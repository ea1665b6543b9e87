#pragma once
/// The greater of two errors, where an error that is not a number is the greatest.

#include <cmath>

namespace qjulia::test {

inline double worse(double a, double b) { return std::isnan(a) || a >= b ? a : b; }

}  // namespace qjulia::test
