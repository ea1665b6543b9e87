#pragma once
/// SHA-256 (FIPS 180-4), by which a page's policy names the scripts that it may run.

#include <string>
#include <string_view>

namespace qjulia::base {

/// The 32 bytes of the digest.
std::string sha256(std::string_view bytes);

}  // namespace qjulia::base
