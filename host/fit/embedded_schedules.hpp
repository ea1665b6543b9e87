#pragma once
#include <functional>
#include <map>
#include <string>
#include <string_view>

namespace qjulia::fitting {

/// The built-in schedules (schedules/*.toml) by path from this folder; generated at build time.
const std::map<std::string, std::string_view, std::less<>>& embedded_schedules();

}  // namespace qjulia::fitting
