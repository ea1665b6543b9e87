#pragma once
#include <functional>
#include <map>
#include <string>
#include <string_view>

namespace qjulia::picture {

/// The built-in looks (looks/*.toml) by path from this folder; generated at build time.
const std::map<std::string, std::string_view, std::less<>>& embedded_looks();

}  // namespace qjulia::picture
