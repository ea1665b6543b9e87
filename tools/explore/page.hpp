#pragma once
/// The page on which a map is played with.

#include <Eigen/Core>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "explore/page_scene.hpp"
#include "qjulia/base/rotation.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia::explore {

/// What the camera of a map's page frames: points that reach about as far in every direction as the
/// set does, shape units.
/// @throws Error where the device or the map cannot tell, Interrupted
std::vector<Eigen::Vector3d> page_outline(const Device& device, const Map& map,
                                          const std::stop_token& stop = {});

/// The same by the box of the shape, where no device tells of the set; of a map without a box, by
/// one that holds most sets.
std::vector<Eigen::Vector3d> box_outline(const Map& map);

/// What the outline of the map's file becomes where the knob "rotate" turns the shape.
std::vector<Eigen::Vector3d> turned_outline(const Map& map, std::vector<Eigen::Vector3d> outline,
                                            const Rotation& rotation);

/// Rounded to 1e-7 of a point's distance from the origin, which keeps pages short.
std::string outline_json(std::span<const Eigen::Vector3d> outline);

/// One page that needs nothing else: the map stands in it, and the viewer's browser draws its set
/// by WebGL 2. Its policy lets it load nothing and run no script but its own.
/// @param file the name of the map's file, for the command lines that the page gives.
/// @param scene of the same map.
/// @param outline what the camera frames.
std::string shared_page(const Map& map, const std::string& file, const PageScene& scene,
                        std::span<const Eigen::Vector3d> outline);

/// The page that `Server` gives out, which asks the server for its pictures.
std::string served_page(const Map& map, const std::string& file,
                        std::span<const Eigen::Vector3d> outline);

/// The page that shows a fit while it runs.
/// @param file the name of the file that its map is to have.
std::string fitting_page(const std::string& file);

}  // namespace qjulia::explore
