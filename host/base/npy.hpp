#pragma once
/// NumPy's format for arrays.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <bit>
#include <cstddef>
#include <limits>
#include <span>
#include <string>

namespace qjulia::base {

static_assert(std::endian::native == std::endian::little, "the header says so");
static_assert(std::numeric_limits<float>::is_iec559 && std::numeric_limits<double>::is_iec559);

/// What stands before the values of an array in C order: float32, or float64 where `dbl`.
/// https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html, version 1.0.
inline std::string npy_header(std::span<const std::size_t> shape, bool dbl) {
  std::string text = fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}), }}",
                                 dbl ? "<f8" : "<f4", fmt::join(shape, ", "));
  constexpr std::size_t kBefore = 10;  // magic, version, length
  constexpr std::size_t kAlignment = 64;
  text.append(kAlignment - 1 - (kBefore + text.size()) % kAlignment, ' ');
  text += '\n';
  std::string header = "\x93NUMPY\x01";
  header += '\0';
  header += static_cast<char>(text.size() & 0xFFU);
  header += static_cast<char>(text.size() >> 8U);
  return header + text;
}

}  // namespace qjulia::base
