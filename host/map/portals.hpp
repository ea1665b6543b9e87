#pragma once
/// A map's portals: what they must be, how far they and their copies reach.

#include <optional>
#include <utility>
#include <vector>

#include "qjulia/map/map.hpp"

namespace qjulia::map {

/// @throws InputError naming what is wrong.
void check_portals(const std::vector<Portal>& portals);

bool holds_origin(const std::vector<Portal>& portals);

/// The least and the greatest distance of their points from the origin; infinity and 0 without
/// portals.
std::pair<double, double> portal_reach(const std::vector<Portal>& portals);

/// The smallest box along the axes that holds to + matrix (x − from) for all x of a box.
Box image_of(const Box& box, const Eigen::Matrix3d& matrix, const Eigen::Vector3d& from,
             const Eigen::Vector3d& to);

/// The map's box and those of its copies in portals, shape units; none where the map has no box.
std::optional<Box> box_with_copies(const Map& map);

}  // namespace qjulia::map
