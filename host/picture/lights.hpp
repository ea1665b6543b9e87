#pragma once
/// The light the shape stands in: lamps, a sky, and the floor's glow.

#include <span>
#include <vector>

#include "picture/environment.hpp"
#include "picture/view.hpp"
#include "qjulia/picture/light.hpp"

namespace qjulia::picture {

/// Light from one direction, with the view its depth map is taken in.
struct Light {
  Eigen::Vector3d towards = Eigen::Vector3d::Zero();  ///< unit
  Eigen::Vector3d color = Eigen::Vector3d::Zero();    ///< irradiance of a surface that faces it
  /// Tangent of its angular radius; of a light of the sky, with which shadows of several run into
  /// one another.
  double softness = 0;
  View view;
  std::vector<float> depths{};  ///< the view's depth map, once it is taken
};

/// Lights as layout/picture_layout.h says.
struct PackedLights {
  std::vector<float> reals;
  std::vector<float> atlas;  ///< their depth maps
};
PackedLights packed(std::span<const Light> lights);

/// What the surroundings send from all sides, per steradian.
struct Surroundings {
  Eigen::Vector3d zenith, horizon, floor;
};
Surroundings surroundings_of(const Rig& rig);

/// An environment about a set.
struct Surrounded {
  EnvironmentLight light;
  double turn = 0;  ///< degrees about the up axis, as a camera's azimuth turns

  /// Its axes, where `up` is up.
  CameraAxes axes(UpAxis up) const {
    return camera_axes({.azimuth = turn, .elevation = 0, .up = up});
  }
};

/// The light on the studio's wall, relative to that of the studio's rig.
/// @param around where it takes the place of the rig's sky; else null.
Eigen::Vector3d wall_light(const Rig& rig, const Surrounded* around = nullptr);

/// @param around as above. @param held a box that holds the shape. @param fineness of the depth
/// maps: 1 for a picture of 1280 × 960, in proportion for smaller ones.
std::vector<Light> sky_lights(const Rig& rig, const Surrounded* around, UpAxis up, const Box& held,
                              double fineness, int count);

/// The rig's lamps and the environment's sun, the key light first and with the finest map. The sun
/// stays with the shape. @param turn degrees about the up axis, where the lamps' azimuths count
/// from.
std::vector<Light> lamp_lights(const Rig& rig, const Surrounded* around, double turn, UpAxis up,
                               const Box& held, double fineness);

}  // namespace qjulia::picture
