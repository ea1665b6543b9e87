#include "picture/material_traits.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace qjulia::picture {
using Eigen::Vector3d;

std::vector<float> material_traits(const OrbitsTell& orbits, const Coloring& coloring,
                                   const std::vector<Vector3d>& points,
                                   std::span<const double> widths) {
  switch (coloring.material) {
    case Material::iterations:
    case Material::trap:
    case Material::groove:
    case Material::factor:
      return orbits(points, widths);
    case Material::height:
    case Material::clay:  // whose numbers are not looked at
      break;
  }
  std::vector<float> heights;
  heights.reserve(points.size());
  for (const Vector3d& point : points) {
    heights.push_back(static_cast<float>(coloring.to_scene.to_shape(point).dot(coloring.up)));
  }
  return heights;
}

double share_of(const MaterialRange& range, double trait) {
  const auto parts = static_cast<double>(range.between.size() + 1);
  double low = range.low, part = 0;
  for (const double value : range.between) {
    if (trait < value) return std::clamp((part + (trait - low) / (value - low)) / parts, 0.0, 1.0);
    low = value;
    ++part;
  }
  return std::clamp((part + (trait - low) / (range.high - low)) / parts, 0.0, 1.0);
}

Rgb color_at(const Palette& palette, double share) {
  const auto last = static_cast<double>(palette.stops.size() - 1);
  const double way = last * std::clamp(share, 0.0, 1.0);
  const auto stop = static_cast<std::size_t>(std::min(std::floor(way), last - 1));
  const double rest = way - static_cast<double>(stop);
  return (1 - rest) * palette.stops[stop] + rest * palette.stops[stop + 1];
}

double stratum_at(double way_inside) {
  // Depths at which the first ring ends, and at which half of the way to the core is done.
  constexpr double kRing = 0.012, kHalf = 0.06;
  // Where F is -inf, points lie infinitely deep.
  constexpr double kVeryDeep = 1e3;
  const double depth = way_inside > 0 ? std::min(way_inside, kVeryDeep) : 0;
  const double core = depth / (depth + kHalf);
  const double ring = 0.5 + 0.5 * std::cos(2 * std::numbers::pi * std::log2(1 + depth / kRing));
  return std::clamp(0.8 - 0.65 * core + 0.35 * (ring - 0.5), 0.0, 1.0);
}

}  // namespace qjulia::picture
