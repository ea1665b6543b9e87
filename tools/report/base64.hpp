#pragma once

#include <string>
#include <string_view>

namespace qjulia::report {

/// RFC 4648, section 4, padded: for pictures inside a page.
std::string base64(std::string_view bytes);

}  // namespace qjulia::report
