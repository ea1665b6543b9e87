#include "picture/band_grid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "map/map_buffer.hpp"
#include "qjulia/shared/picture_layout.h"

namespace qjulia {
namespace {

constexpr int kFirstCells = 64;  ///< along the ball, to find the band's box
constexpr int kCells = 144;      ///< along the band's longest side

/// Nearly the greatest ‖∇F₁‖ where F₁ = level: the 95th percentile over points scattered in the
/// box and led there by Newton's steps along the gradient.
double steepest_slope(const Field& field, double slice, double level, const Box& box) {
  std::mt19937_64 random(1);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  std::vector<Quaternion> points(4096);
  for (Quaternion& q : points) {
    q = {std::lerp(box.low.x(), box.high.x(), uniform()),
         std::lerp(box.low.y(), box.high.y(), uniform()),
         std::lerp(box.low.z(), box.high.z(), uniform()), slice};
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
  if (slopes.empty()) return 20 / box.diagonal();
  const auto at =
      slopes.begin() + static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(slopes.size()));
  std::ranges::nth_element(slopes, at);
  return *at;
}

/// A grid over the box, `cells` along its longest side.
Grid grid_over(const Box& box, int cells) {
  Grid grid;
  grid.step = box.size().maxCoeff() / cells;
  grid.origin = box.low;
  for (std::size_t i = 0; i < 3; ++i) {
    const double side = box.size()[static_cast<Eigen::Index>(i)];
    grid.points[i] = std::max(2, static_cast<int>(std::ceil(side / grid.step)) + 1);
  }
  return grid;
}

/// The box of the points whose safe step is shorter than a cell, and a cell around.
Box close_box(const Grid& grid, const std::vector<double>& safe) {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::max());
  Eigen::Vector3d high = -low;
  std::size_t at = 0;
  for (int k = 0; k < grid.points[2]; ++k) {
    for (int j = 0; j < grid.points[1]; ++j) {
      for (int i = 0; i < grid.points[0]; ++i, ++at) {
        if (safe[at] >= grid.step) continue;
        const Eigen::Vector3d p = grid.at({double(i), double(j), double(k)});
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
      }
    }
  }
  const Eigen::Vector3d cell = Eigen::Vector3d::Constant(grid.step);
  if (low.x() > high.x()) return {-cell, cell};
  return {low - cell, high + cell};
}

/// @param seen the part of space that rays go through.
std::vector<double> packed(const Grid& grid, const Box& seen) {
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

/// The box in both; a point of `b` where they have nothing in common.
Box common(const Box& a, const Box& b) {
  Box both{a.low.cwiseMax(b.low), a.high.cwiseMin(b.high)};
  if ((both.size().array() > 0).all()) return both;
  const Eigen::Vector3d least = Eigen::Vector3d::Constant(1e-6 * b.diagonal());
  return {b.center() - least, b.center() + least};
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
  band.steepest = steepest_slope(Field(device, map, Precision::single, band.stops), map.slice,
                                 band.level, within);
  return band;
}

BandGrid::BandGrid(const Device& device, const MarchedSet& set, const Band& band)
    : device_(device),
      map_(set.map),
      iterations_(set.iterations),
      precision_(set.precision),
      band_(band),
      map_buffer_(upload_map(device.context(), set.map, band.stops, set.precision)) {
  device::Context& context = device_.context();
  const Eigen::Vector3d corner = Eigen::Vector3d::Constant(band.radius);
  const Grid first = grid_over({-corner, corner}, kFirstCells);
  bounds_ = close_box(first, safe_steps(first));
  if (set.part) bounds_ = common(bounds_, *set.part);
  grid_ = grid_over(bounds_, kCells);
  layout_ = context.upload_real(packed(grid_, bounds_), precision_);
  safe_ = context.upload_real(safe_steps(grid_), precision_);
}

std::vector<double> BandGrid::safe_steps(const Grid& grid) const {
  device::Context& context = device_.context();
  const int lanes = device_.lane_width(precision_);
  const auto kernel = context.kernel("ray_march.cl", "safe_steps", {lanes, precision_, {}});
  const auto layout = context.upload_real(packed(grid, {}), precision_);
  std::vector<double> safe(GridBlock{{0, 0, 0}, grid.points}.size());
  const auto wide = static_cast<std::size_t>(lanes);
  const std::size_t all = (safe.size() + wide - 1) / wide;
  // About 30 ms of potentials on two cores.
  const std::size_t most = std::max<std::size_t>(1, (1U << 27U) / (wide * packed_factors(map_)));
  const auto out = context.allocate_real(std::min(all, most) * wide, precision_);
  for (std::size_t done = 0; done < all; done += most) {
    const std::size_t groups = std::min(most, all - done);
    context.launch(kernel, {{groups, 1, 1}},
                   {layout, static_cast<std::int32_t>(done), static_cast<std::int32_t>(groups),
                    map_buffer_, static_cast<std::int32_t>(packed_factors(map_)),
                    device::Argument::real(band_.level, precision_),
                    device::Argument::real(band_.steepest, precision_), out});
    const std::size_t begin = done * wide;
    context.read(out, std::span(safe).subspan(begin, std::min(groups * wide, safe.size() - begin)));
  }
  return safe;
}

std::vector<float> BandGrid::depths(const View& view, int first_row, int rows) {
  device::Context& context = device_.context();
  if (values_.size() == 0) {
    std::vector<double> values;
    const int slices_a_part = slices_at_once(grid_);
    const LevelSet set(device_, map_, band_.stops, iterations_, precision_);
    for (int z = 0; z < grid_.points[2]; z += slices_a_part) {
      const auto part =
          set.over(grid_, slices(grid_, z, std::min(slices_a_part, grid_.points[2] - z)));
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

}  // namespace qjulia
