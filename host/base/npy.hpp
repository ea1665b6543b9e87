#pragma once
/// NumPy's format for arrays.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <bit>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

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

/// What an array says before its values.
struct NpyHeader {
  std::string type;  ///< such as "<f4"; empty: it is none of plain numbers
  bool is_fortran = false;
  std::vector<std::size_t> shape;
  std::size_t bytes = 0;  ///< of the header, before the values
};

/// The longest header that is read: one of version 1.0 is not longer.
constexpr std::size_t kMostNpyHeader = 10 + 0xffff;

/// The header that the bytes begin with, of versions 1.0 to 3.0; none where there is no whole one.
std::optional<NpyHeader> read_npy_header(std::string_view bytes);

}  // namespace qjulia::base
