#include "picture/band_grid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "base/random.hpp"
#include "device/point_batch.hpp"
#include "layout/picture_layout.h"

namespace qjulia::picture {
namespace {

constexpr int kFirstCells = 64;  ///< along the ball, to find the band's box
constexpr int kCells = 144;      ///< along the band's longest side

/// Nearly the greatest ‖∇F₁‖ where F₁ = level: the 95th percentile over points scattered in the
/// box and led there by Newton's steps along the gradient. Nothing where none of them gets there.
std::optional<double> steepest_slope(const Field& field, double slice, double level,
                                     const Box& box) {
  base::Random random(1);
  std::vector<Quaternion> points(4096);
  for (Quaternion& q : points) {
    q = {std::lerp(box.low.x(), box.high.x(), random.uniform()),
         std::lerp(box.low.y(), box.high.y(), random.uniform()),
         std::lerp(box.low.z(), box.high.z(), random.uniform()), slice};
  }
  std::vector<double> slopes;
  for (int step = 0; step < 5; ++step) {
    const auto values = field.at(points, 1);
    const auto gradients = field.gradient_at(points);
    slopes.clear();
    for (std::size_t i = 0; i < points.size(); ++i) {
      Quaternion g = gradients[i];
      g.w = 0;
      const double above = values[i] - level, slope = norm(g);
      if (std::abs(above) < 0.5 && std::isfinite(slope)) slopes.push_back(slope);
      if (slope > 0) points[i] = points[i] - (std::clamp(above / slope, -0.5, 0.5) / slope) * g;
    }
  }
  if (slopes.empty()) return std::nullopt;
  const auto at =
      slopes.begin() + static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(slopes.size()));
  std::ranges::nth_element(slopes, at);
  return *at;
}

/// A grid over the box, `cells` along its longest side.
surface::Grid grid_over(const Box& box, int cells) {
  surface::Grid grid;
  grid.step = box.size().maxCoeff() / cells;
  grid.origin = box.low;
  for (std::size_t i = 0; i < 3; ++i) {
    const double side = box.size()[static_cast<Eigen::Index>(i)];
    grid.points[i] = std::max(2, static_cast<int>(std::ceil(side / grid.step)) + 1);
  }
  return grid;
}

/// The box of the points whose safe step is shorter than a cell, and a cell around.
Box close_box(const surface::Grid& grid, const std::vector<double>& safe) {
  const Eigen::Vector3d cell = Eigen::Vector3d::Constant(grid.step);
  const auto close =
      surface::marked_indices(grid, [&](std::size_t i) { return safe[i] < grid.step; });
  if (!close) return {-cell, cell};
  return {grid.at(close->first.cast<double>()) - cell,
          grid.at(close->second.cast<double>()) + cell};
}

/// @param seen the part of space that rays go through.
std::vector<double> packed(const surface::Grid& grid, const Box& seen) {
  std::vector<double> reals(QJ_GRID_SIZE);
  for (std::size_t i = 0; i < 3; ++i) {
    reals[QJ_GRID_ORIGIN + i] = grid.origin[static_cast<Eigen::Index>(i)];
    reals[QJ_GRID_POINTS + i] = grid.points[i];
    reals[QJ_GRID_SEEN_LOW + i] = seen.low[static_cast<Eigen::Index>(i)];
    reals[QJ_GRID_SEEN_HIGH + i] = seen.high[static_cast<Eigen::Index>(i)];
  }
  reals[QJ_GRID_STEP] = grid.step;
  return reals;
}

/// The box in both; nothing where they have nothing in common.
std::optional<Box> common(const Box& a, const Box& b) {
  const Box both{a.low.cwiseMax(b.low), a.high.cwiseMin(b.high)};
  if ((both.size().array() > 0).all()) return both;
  return std::nullopt;
}

}  // namespace

Band find_band(const Device& device, const MarchedSet& set, const Box& shape) {
  const RationalMap& map = set.map;
  Band band;
  band.stops = find_stop_radii(device, map, set.escape);
  band.radius = 1.001 * std::min(band.stops.outer, band.stops.escape);
  band.level = set.iterations == 1 ? map.surface_level
                                   : std::log(std::min(band.stops.outer, band.stops.escape));
  const Eigen::Vector3d corner = Eigen::Vector3d::Constant(band.radius);
  const Box within{shape.low.cwiseMax(-corner), shape.high.cwiseMin(corner)};
  const Field field(device, without_portals(map), Precision::single, band.stops);
  const Box ball{-corner, corner};
  std::optional<double> steepest = steepest_slope(field, map.slice, band.level, within);
  if (!steepest) steepest = steepest_slope(field, map.slice, band.level, ball);
  band.steepest = steepest.value_or(20 / ball.diagonal());
  // In a portal F_1 = ln ‖image‖ rises by its scale over the image's radius.
  for (const Portal& portal : map.portals) {
    band.steepest = std::max(band.steepest, portal.scale / std::exp(band.level));
  }
  return band;
}

BandGrid::BandGrid(const Device& device, const MarchedSet& set, const Band& band)
    : device_(device),
      map_(set.map),
      iterations_(set.iterations),
      precision_(set.precision),
      band_(band),
      device_map_(device, set.map, band.stops, set.precision) {
  device::Context& context = device_.context();
  const Eigen::Vector3d corner = Eigen::Vector3d::Constant(band.radius);
  const surface::Grid first = grid_over({-corner, corner}, kFirstCells);
  bounds_ = close_box(first, safe_steps(first));
  if (set.part) {
    const std::optional<Box> seen = common(bounds_, *set.part);
    is_empty_ = !seen;
    bounds_ = seen.value_or(*set.part);
  }
  grid_ = grid_over(bounds_, kCells);
  layout_ = context.upload_real(packed(grid_, bounds_), precision_);
  safe_ = context.upload_real(safe_steps(grid_), precision_);
}

std::vector<double> BandGrid::safe_steps(const surface::Grid& grid) const {
  const auto layout = device_.context().upload_real(packed(grid, {}), precision_);
  device::PointBatch batch(device_.context(), device_map_.kernel("ray_march.cl", "safe_steps"),
                           precision_, device_map_.lanes(), device_map_.modulus_cost());
  std::vector<double> safe(surface::whole(grid).size());
  batch.run<0, 1>(
      safe.size(), device::PointBatch::NoInputs{},
      [&](const device::PointBatch::Part& part) {
        return std::vector<device::Argument>{layout,
                                             device::narrow(part.first / device_map_.lanes()),
                                             device::narrow(part.items),
                                             device_map_.buffer(),
                                             device_map_.factors(),
                                             iterations_,
                                             device_map_.real(band_.level),
                                             device_map_.real(band_.steepest),
                                             part.out};
      },
      [&](std::size_t i, const std::array<double, 1>& step) { safe[i] = step[0]; });
  return safe;
}

std::vector<float> BandGrid::depths(const View& view, int first_row, int rows) {
  device::Context& context = device_.context();
  if (values_.size() == 0) {
    std::vector<double> values;
    const int slices_a_part = surface::slices_at_once(grid_);
    const surface::LevelSet set(device_, map_, band_.stops, iterations_, precision_);
    for (int z = 0; z < grid_.points[2]; z += slices_a_part) {
      const auto part =
          set.over(grid_, surface::slices(grid_, z, std::min(slices_a_part, grid_.points[2] - z)));
      values.insert(values.end(), part.begin(), part.end());
    }
    // Far values say nothing about where between two points the surface lies.
    for (double& value : values) value = std::clamp(value - map_.surface_level, -1.0, 1.0);
    values_ = context.upload_real(values, precision_);
    grid_depth_ = context.kernel("ray_grid.cl", "grid_depth", {1, precision_, {}});
  }
  const auto wide = static_cast<std::size_t>(view.columns);
  const auto deep = static_cast<std::size_t>(rows);
  const auto out = context.allocate_real(wide * deep, precision_);
  context.launch(grid_depth_, {{(wide + 7) / 8 * 8, (deep + 7) / 8 * 8, 1}, {8, 8, 1}},
                 {context.upload_real(view.packed(), precision_), view.columns, first_row, rows,
                  layout_, safe_, values_, out});
  std::vector<double> depths(wide * deep);
  context.read(out, depths);
  return {depths.begin(), depths.end()};
}

}  // namespace qjulia::picture
