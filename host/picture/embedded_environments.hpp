#pragma once
#include <functional>
#include <map>
#include <string>
#include <string_view>

namespace qjulia::picture {

/// The built-in environments (environments/*.hdr) by path from this folder; generated at build
/// time.
const std::map<std::string, std::string_view, std::less<>>& embedded_environments();

}  // namespace qjulia::picture
