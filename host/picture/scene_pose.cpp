#include "qjulia/picture/scene_pose.hpp"

#include <cmath>

#include "base/range_check.hpp"
#include "picture/lights.hpp"
#include "picture/view.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia {

CameraPose pose_of(const Camera& camera, int width, int height) {
  PictureOptions options;
  options.camera = camera;
  options.width = width;
  options.height = height;
  options.validate();
  if (!camera.look_at) throw OptionError("look_at", "it is missing; give the point to look at");
  if (!camera.distance)
    throw OptionError("distance", "it is missing; give the distance to the eye");
  if (picture::is_parallel(camera)) {
    throw OptionError(
        "field_of_view",
        "parallel rays (0) have no place of the eye; give a number of degrees above 0");
  }
  const picture::View view = picture::camera_view(camera, {}, width, height, 1);
  const picture::CameraAxes axes = picture::camera_axes(camera);
  CameraPose pose;
  pose.eye = view.eye;
  pose.axes << axes.right, axes.up, axes.back;
  pose.field_of_view = 2 * std::atan(0.5 * height * view.dir_dy.norm()) / picture::kDegree;
  return pose;
}

std::vector<LampPose> lamp_poses(const Lighting& light, const Camera& camera) {
  light.validate();
  PictureOptions options;
  options.camera = camera;
  options.validate();
  std::vector<LampPose> poses;
  for (const Lamp& lamp : light.whole().lamps) {
    const Camera there{.azimuth = light.lamp_turn.value_or(camera.azimuth) + lamp.azimuth,
                       .elevation = 0,
                       .up = camera.up};
    const picture::CameraAxes axes = picture::camera_axes(there);
    const double elevation = lamp.elevation * picture::kDegree;
    poses.push_back({std::cos(elevation) * axes.back + std::sin(elevation) * axes.up,
                     lamp.color.linear(), lamp.strength, lamp.size});
  }
  return poses;
}

}  // namespace qjulia
