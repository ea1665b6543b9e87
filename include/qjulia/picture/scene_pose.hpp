#pragma once
/// Where the camera and the lamps of a picture are, for other programs.

#include <Eigen/Core>
#include <vector>

#include "qjulia/base/up_axis.hpp"
#include "qjulia/picture/picture.hpp"

namespace qjulia {

/// A camera whose zoom is part of its field of view.
struct CameraPose {
  Eigen::Vector3d eye;  ///< shape units
  /// Columns: to the right, up, and from what is seen to the eye.
  Eigen::Matrix3d axes;
  double field_of_view;  ///< degrees, vertical; zoom and frame have narrowed it
};

/// A lamp so far away that its light is parallel.
struct LampPose {
  Eigen::Vector3d towards;  ///< of length 1, from the shape to the lamp
  Rgb color;                ///< linear sRGB
  double strength;          ///< 0 … 100, as in `Lamp`
  double size;              ///< degrees from its middle to its edge
};

/// The pose of a camera that has `look_at` and `distance`, as those of `Studio::aimed` have.
/// @throws OptionError for another camera, for one with parallel rays, or for pictures without
///   pixels
CameraPose pose_of(const Camera& camera, int width, int height);

/// The rig's lamps; an environment's sun is none of them. @throws OptionError
std::vector<LampPose> lamp_poses(const Lighting& light, const Camera& camera);

}  // namespace qjulia
