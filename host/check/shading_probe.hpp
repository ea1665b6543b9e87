#pragma once
/// The kernels that shade and develop, on surfaces and light of one's own.

#include <span>
#include <vector>

#include "picture/shading.hpp"

namespace qjulia::check {

/// Points seen along -z that get even light from all around, and all of each lamp's.
struct ShadingProbe {
  picture::Scene scene{};  ///< its clay is the points' colour
  double even_light = 0;   ///< radiance of the surroundings
  std::vector<picture::Light> lamps{};

  /// Radiance that points with these unit normals send to the viewer.
  std::vector<Rgb> radiance(const Device& device, std::span<const Eigen::Vector3d> normals) const;
};

/// sRGB bytes of pixels of these radiances.
std::vector<std::uint8_t> developed(const Device& device, ToneCurve tone,
                                    std::span<const Rgb> radiances);

/// `count` lamps that together light a point evenly with radiance 1.
std::vector<picture::Light> even_lamps(int count);

}  // namespace qjulia::check
