#pragma once
/// A map's portals: what they must be, how a map file holds them, how far they and their copies
/// reach.

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "qjulia/rational_map.hpp"

namespace qjulia::map {

/// @throws InputError naming what is wrong.
void check_portals(const std::vector<Portal>& portals);

bool holds_origin(const std::vector<Portal>& portals);

/// The least and the greatest distance of their points from the origin; infinity and 0 without
/// portals.
std::pair<double, double> portal_reach(const std::vector<Portal>& portals);

/// The map's box and those of its copies in portals, shape units; none where the map has no box.
std::optional<Box> box_with_copies(const RationalMap& map);

nlohmann::json portals_json(const std::vector<Portal>& portals);
/// @param source what messages call the file. @throws InputError naming the key.
std::vector<Portal> read_portals(const nlohmann::json& portals, const std::string& source);

}  // namespace qjulia::map
