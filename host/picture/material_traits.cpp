#include "picture/material_traits.hpp"

#include <algorithm>
#include <cmath>

#include "picture/depth_source.hpp"
#include "picture/view.hpp"

namespace qjulia::picture {
namespace {

using Eigen::Vector3d;

/// Shares of what occurs below the palette's beginning and above its end.
constexpr double kTail = 0.05;
/// The set is looked at from six sides, by kRangeSide × kRangeSide rays each. The band's grid need
/// not be fine for so few.
constexpr int kRangeSide = 32, kRangeCells = 72;
/// What points stand for, over the diagonal of the shape's box.
constexpr double kPointWidth = 1.0 / 500;
/// A palette is spread over at least this much of the orbits' numbers, 0 … 1, so that it does not
/// show what differs by chance alone.
constexpr double kLeastSpread = 0.1;

double percentile(std::vector<float>& values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(
                                       std::lround(share * static_cast<double>(values.size() - 1)));
  std::ranges::nth_element(values, at);
  return double{*at};
}

/// Where rays from six sides meet the set.
std::vector<Vector3d> seen_points(DepthSource& source, double width) {
  std::vector<Vector3d> points;
  for (const double sign : {-1.0, 1.0}) {
    for (const Eigen::Index axis : {0, 1, 2}) {
      View view = parallel_view(sign * Vector3d::Unit(axis), source.bounds(), kRangeSide);
      view.footprint = std::min(view.footprint, width);
      view.tolerance = 0.5 * view.footprint;
      const std::vector<float> depths = source.depths(view, 0, view.rows);
      for (int i = 0; i < kRangeSide * kRangeSide; ++i) {
        const double depth = double{depths[static_cast<std::size_t>(i)]};
        const int column = i % kRangeSide, row = i / kRangeSide;
        if (depth >= 0) points.push_back(view.at(column + 0.5, row + 0.5, depth));
      }
    }
  }
  return points;
}

}  // namespace

std::vector<float> material_traits(const OrbitsTell& orbits, const Coloring& coloring,
                                   const std::vector<Vector3d>& points,
                                   std::span<const double> widths) {
  if (coloring.material != Material::height) return orbits(points, widths);
  std::vector<float> heights;
  heights.reserve(points.size());
  for (const Vector3d& point : points) {
    heights.push_back(static_cast<float>(coloring.to_scene.to_shape(point).dot(coloring.up)));
  }
  return heights;
}

MaterialRange material_range(const Device& device, const Map& map, const RangeQuery& query,
                             const std::stop_token& stop) {
  const auto source = march_source(device, {.map = map,
                                            .iterations = query.iterations,
                                            .escape = query.escape,
                                            .part = {},
                                            .precision = query.precision,
                                            .material = query.coloring.material,
                                            .stop = stop,
                                            .interpolates_images = false,
                                            .cells = kRangeCells});
  const Box shape =
      map.frame.box ? map.frame.shape_to_map.to_map(*map.frame.box) : source->bounds();
  const double width = kPointWidth * shape.diagonal();
  std::vector<float> traits = material_traits(
      [&](const auto& points, auto widths) { return source->traits(points, widths); },
      query.coloring, seen_points(*source, width), std::span(&width, 1));
  std::erase_if(traits, [](float trait) { return !std::isfinite(trait); });
  if (traits.empty()) return {};
  MaterialRange range{percentile(traits, kTail), percentile(traits, 1 - kTail)};
  const double least = query.coloring.material == Material::height ? 1e-9 : kLeastSpread;
  if (range.high - range.low < least) {
    const double middle = 0.5 * (range.low + range.high);
    range = {middle - 0.5 * least, middle + 0.5 * least};
  }
  return range;
}

double share_of(const MaterialRange& range, double trait) {
  return std::clamp((trait - range.low) / (range.high - range.low), 0.0, 1.0);
}

}  // namespace qjulia::picture
