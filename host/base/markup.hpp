#pragma once
/// Text inside HTML and XML.

#include <string>
#include <string_view>

namespace qjulia::base {

/// The text as it stands between tags and in quoted attributes: UTF-8, with U+FFFD in place of
/// control characters and of bytes that are no UTF-8.
std::string markup(std::string_view text);

}  // namespace qjulia::base
