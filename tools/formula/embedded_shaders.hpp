#pragma once
#include <functional>
#include <map>
#include <string>
#include <string_view>

namespace qjulia::formula {

/// The GLSL of shaders/ and of the page's map (tools/explore/page), by path from tools/; generated
/// at build time.
const std::map<std::string, std::string_view, std::less<>>& embedded_shaders();

}  // namespace qjulia::formula
