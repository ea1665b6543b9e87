#pragma once
/// What a page may set of a map and its picture.

#include <string>

#include "explore/page_scene.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia::explore {

/// JSON: under "map" the iterations and the knobs that the map bears, under "picture" the settings
/// of pictures, each with its controls and their usual values. Settings without controls are left
/// out. State in a page's address, commands it gives and requests it makes follow from these alone.
/// Under "frame" is where the shape lies, under "absent" are the labels of controls that need a
/// server where the page has none.
/// @param scene of a page that draws by itself; none where a server draws.
std::string page_settings(const Map& map, const PageScene* scene);

}  // namespace qjulia::explore
