#pragma once
/// How pictures (.png) and scenes (.glb) hold a map: packed, in chunks of its own, which other
/// programs pass over.

#include <cstddef>
#include <string_view>

namespace qjulia::base {

/// The type of a .png's chunk (PNG specification, 5.4): ancillary, private, safe to copy. A long
/// map is cut into several chunks, because some readers refuse chunks above 8 MB.
constexpr std::string_view kPngMapChunk = "qjMp";
constexpr std::size_t kLargestPngMapChunk = std::size_t{1} << 20U;  // bytes

/// The type of a .glb's chunk, which comes after the buffer (glTF 2.0, 4.4.3: readers ignore chunks
/// of types that they do not know).
constexpr std::string_view kGlbMapChunk = "QJMP";

}  // namespace qjulia::base
