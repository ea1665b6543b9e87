#pragma once
/// What a page that draws by itself needs of a map, as it hands it to its shaders.

#include <map>
#include <stop_token>
#include <string>

#include "qjulia/device/device.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia::explore {

/// The files that shaders of this map include by a name: "QJ_MODULUS" is that of its modulus.
std::map<std::string, std::string> shader_files(const Map& map);

struct PageScene {
  std::string json;
  double most_drift = 0;  ///< the origin of iteration stays in the shape up to it
};

/// JSON: the shader files of the map's kinds, its values as their uniforms, and tables of what
/// follows from knobs (`SceneTable`, and ranges of materials), in which the page looks up.
/// Takes seconds. @throws InputError, DeviceError, Interrupted
PageScene page_scene(const Device& device, const Map& map, const std::stop_token& stop = {});

}  // namespace qjulia::explore
