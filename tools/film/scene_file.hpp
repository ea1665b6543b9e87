#pragma once
/// Cameras and lamps of a film as files that other programs read.

#include <filesystem>
#include <string>
#include <vector>

#include "qjulia/base/up_axis.hpp"
#include "qjulia/picture/scene_pose.hpp"

namespace qjulia::film {

struct FilmScene {
  std::vector<CameraPose> cameras;           ///< of each picture, one or more
  std::vector<std::vector<LampPose>> lamps;  ///< of each picture, equally many
  double aspect = 1;                         ///< width of the pictures by their height
  double rate = 25;                          ///< pictures a second
  UpAxis up = kDefaultUp;                    ///< the shape's, which is the file's Y
};

/// Whether a .glb shows the cameras as they are: it cannot change a camera's field of view.
bool fits_glb(const FilmScene& scene);

/// .glb, with animations and KHR_lights_punctual, or .usda, with time samples. A unit of the shape
/// is a metre, as in surfaces. @throws OutputError
void write_scene(const FilmScene& scene, const std::filesystem::path& path,
                 const std::string& note);

}  // namespace qjulia::film
