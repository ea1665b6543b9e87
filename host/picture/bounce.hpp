#pragma once
/// Light that lamps send to the shape and the shape sends on: what a lamp's depth map sees, as many
/// small lights (Dachsbacher and Stamminger 2005, "Reflective shadow maps").

#include <vector>

#include "picture/lights.hpp"
#include "qjulia/base/colors.hpp"

namespace qjulia::picture {

/// What a lamp lights, at half the fineness of its depth map.
struct LitSurface {
  View view;                   ///< of these texels
  std::vector<float> depths;   ///< QJ_NO_HIT where nothing is
  std::vector<float> normals;  ///< 3 a texel; the longer the more alike the normals around are
};

/// @param normals 3 for each texel of the lamp's depth map.
LitSurface lit_surface(const Light& lamp, const std::vector<float>& normals);

/// Levels of it, each half as fine as the one before, to the last: texels as
/// layout/picture_layout.h has them. @param albedo of the surface's texels.
std::vector<float> bounce_levels(const LitSurface& surface, const std::vector<Rgb>& albedo);

}  // namespace qjulia::picture
