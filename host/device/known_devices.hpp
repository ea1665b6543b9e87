#pragma once
#include <map>
#include <string>
#include <string_view>

namespace qjulia {
class Device;
}

namespace qjulia::device {

/// known_devices.json: settings that were measured on devices and sent in; generated at build time.
const std::map<std::string, std::string_view, std::less<>>& known_devices();

/// The device with the settings that such a table has for it: its own where it has none.
/// @throws InputError when these are wrong.
Device with_table(const Device& device, std::string_view table);

}  // namespace qjulia::device
