#pragma once
/// The values of a material at points of a set, for pictures and meshes alike, and the range of
/// values that a palette covers.

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "qjulia/device/device.hpp"
#include "qjulia/map/map.hpp"
#include "qjulia/picture/picture.hpp"

namespace qjulia::picture {

/// What a material's numbers depend on, besides the orbits that a source runs.
struct Coloring {
  Material material = Material::clay;
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();  ///< along which height is measured
  ShapeToMap to_scene{};                          ///< from the shape's coordinates to the points'
};

/// The orbits' numbers at points that stand for balls of these widths: one for all, or one for
/// each.
using OrbitsTell = std::function<std::vector<float>(const std::vector<Eigen::Vector3d>& points,
                                                    std::span<const double> widths)>;

/// One number per point. @param orbits are asked where the material is of orbits.
/// @throws what `orbits` throws.
std::vector<float> material_traits(const OrbitsTell& orbits, const Coloring& coloring,
                                   const std::vector<Eigen::Vector3d>& points,
                                   std::span<const double> widths);

/// The way through the palette, 0 … 1, to what the material shows.
double share_of(const MaterialRange& range, double trait);

/// Through the palette's colours, 0 … 1, in linear light as pictures go.
Rgb color_at(const Palette& palette, double share);

/// The position in the palette, 0 … 1, on a cut face at this depth below the surface, in diagonals
/// of the shape's box. It starts at the palette's end at the rim and goes inward, with rings that
/// are wider the deeper they lie.
double stratum_at(double way_inside);

}  // namespace qjulia::picture
