#pragma once
/// Bytes as text: RFC 4648, section 4, padded.

#include <optional>
#include <string>
#include <string_view>

namespace qjulia::base {

std::string base64(std::string_view bytes);

/// The bytes of such a text; none where it is not one.
std::optional<std::string> from_base64(std::string_view text);

}  // namespace qjulia::base
