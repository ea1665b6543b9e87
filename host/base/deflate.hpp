#pragma once
/// Bytes made small by zlib (RFC 1950), or by deflate alone (RFC 1951), as ZIP archives hold them.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace qjulia::base {

std::string deflated(std::string_view bytes);

/// What `bytes` were made of; none where they are not a whole zlib stream of exactly `size` bytes.
/// Memory grows with what is found, and never beyond twice `size`.
std::optional<std::string> inflated(std::string_view bytes, std::size_t size);

/// Hands what a bare deflate stream was made of to `take`, a part at a time, while that returns
/// true.
/// @return whether `bytes` are a whole stream and no more, and all of it was taken.
bool inflate_bare(std::string_view bytes, const std::function<bool(std::string_view part)>& take);

/// The CRC-32 of ZIP and PNG, of `bytes` after those that gave `before`.
std::uint32_t crc_32(std::string_view bytes, std::uint32_t before = 0);

}  // namespace qjulia::base
