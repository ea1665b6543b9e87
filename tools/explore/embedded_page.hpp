#pragma once
#include <functional>
#include <map>
#include <string>
#include <string_view>

namespace qjulia::explore {

/// The files of page/ by name; generated at build time.
const std::map<std::string, std::string_view, std::less<>>& embedded_page();

}  // namespace qjulia::explore
