#pragma once
#include <functional>
#include <map>
#include <string>
#include <string_view>

namespace qjulia::device {

/// Kernel sources by path from the repository root; generated at build time.
const std::map<std::string, std::string_view, std::less<>>& embedded_kernels();

}  // namespace qjulia::device
