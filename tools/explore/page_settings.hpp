#pragma once
/// What a page may set of a map and its picture.

#include <string>

#include "qjulia/map/map.hpp"

namespace qjulia::explore {

/// JSON: under "map" the iterations and the knobs that the map bears, under "picture" the settings
/// of pictures, each with its controls and their usual values. Settings without controls are left
/// out. State in a page's address, commands it gives and requests it makes follow from these alone.
/// @param is_served whether a server draws, and not the browser.
std::string page_settings(const Map& map, bool is_served);

}  // namespace qjulia::explore
