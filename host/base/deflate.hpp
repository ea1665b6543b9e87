#pragma once
/// Bytes made small by zlib (RFC 1950).

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace qjulia::base {

std::string deflated(std::string_view bytes);

/// What `bytes` were made of; none where they are not a whole zlib stream of exactly `size` bytes.
/// Memory grows with what is found, and never beyond twice `size`.
std::optional<std::string> inflated(std::string_view bytes, std::size_t size);

}  // namespace qjulia::base
