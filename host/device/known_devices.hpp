#pragma once
#include <map>
#include <string>
#include <string_view>

namespace qjulia::device {

/// known_devices.json: settings that were measured on devices and sent in; generated at build time.
const std::map<std::string, std::string_view, std::less<>>& known_devices();

}  // namespace qjulia::device
