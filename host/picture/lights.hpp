#pragma once
/// The light the shape stands in: a key light, a rim light, a sky, and the ground's glow.

#include <span>
#include <vector>

#include "picture/view.hpp"

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

/// @param held a box that holds the shape. @param fineness of the depth maps: 1 for a picture of
/// 1280 × 960, in proportion for smaller ones.
std::vector<Light> sky_lights(UpAxis up, const Box& held, double fineness, int count);

/// They stay with the camera's azimuth, so that the shape turns under them.
struct LampLights {
  Light key;  ///< with a penumbra
  Light rim;  ///< casts no shadow on the ground
};
LampLights lamps(const Camera& camera, const Lamp& key, const Box& held, double fineness);

}  // namespace qjulia::picture
