#pragma once
/// NumPy's format for arrays.

#include <cstddef>
#include <span>
#include <string>

namespace qjulia::base {

/// What stands before the values of an array in C order: float32, or float64 where `dbl`.
/// https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html, version 1.0.
std::string npy_header(std::span<const std::size_t> shape, bool dbl);

}  // namespace qjulia::base
