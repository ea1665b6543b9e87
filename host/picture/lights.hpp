#pragma once
/// The light the shape stands in: lamps, a sky, and the floor's glow.

#include <span>
#include <vector>

#include "picture/view.hpp"
#include "qjulia/light.hpp"

namespace qjulia::picture {

/// Light from one direction, with the view its depth map is taken in.
struct Light {
  Eigen::Vector3d towards = Eigen::Vector3d::Zero();  ///< unit
  Eigen::Vector3d color = Eigen::Vector3d::Zero();    ///< irradiance of a surface that faces it
  double softness = 0;                                ///< tangent of its angular radius
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

/// The light on the studio's wall, relative to that of the studio's rig.
Eigen::Vector3d wall_light(const Rig& rig);

/// @param held a box that holds the shape. @param fineness of the depth maps: 1 for a picture of
/// 1280 × 960, in proportion for smaller ones.
std::vector<Light> sky_lights(const Rig& rig, UpAxis up, const Box& held, double fineness,
                              int count);

/// The rig's lamps, the key light first and with the finest map. They stay with the camera's
/// azimuth, so that the shape turns under them.
std::vector<Light> lamp_lights(const Rig& rig, const Camera& camera, const Box& held,
                               double fineness);

}  // namespace qjulia::picture
