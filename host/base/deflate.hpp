#pragma once
/// Compression by zlib (RFC 1950), and plain deflate streams (RFC 1951), as in ZIP archives.

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

/// Unpacks a plain deflate stream and passes the bytes to `take`, part by part, as long as it
/// returns true.
/// @return whether `bytes` are exactly one complete stream, and `take` accepted all of it.
bool inflate_bare(std::string_view bytes, const std::function<bool(std::string_view part)>& take);

/// The CRC-32 of ZIP and PNG, of `bytes`, continued from the checksum `before` of preceding bytes.
std::uint32_t crc_32(std::string_view bytes, std::uint32_t before = 0);

}  // namespace qjulia::base
