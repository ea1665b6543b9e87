#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <random>

#include "device/context.hpp"
#include "map/map_buffer.hpp"
#include "picture/depth_grid.hpp"
#include "picture/depth_source.hpp"
#include "qjulia/field.hpp"
#include "qjulia/shared/picture_layout.h"

namespace qjulia {
namespace {

using Clock = std::chrono::steady_clock;

/// Seconds a launch should take: work is cut into launches by how long the last one took.
constexpr double kLaunchSeconds = 0.05;

/// The first octaves of detail throw the shadows that can be seen.
constexpr int kShadowIterations = 2;

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

/// One ray of a view, and a depth close before its hit.
struct Ray {
  int column, row;
  float hint = 0;
};

/// The rays of whole rows, in blocks of 4 × 4 pixels, so that lanes do alike.
std::vector<Ray> all_rays(int columns, int first_row, int rows) {
  std::vector<Ray> rays;
  rays.reserve(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  for (int top = first_row; top < first_row + rows; top += 4) {
    for (int left = 0; left < columns; left += 4) {
      for (int row = top; row < std::min(top + 4, first_row + rows); ++row) {
        for (int column = left; column < std::min(left + 4, columns); ++column) {
          rays.push_back({column, row});
        }
      }
    }
  }
  return rays;
}

/// x, y and hint arrays of `stride` reals; the padding repeats the last ray.
std::vector<float> component_arrays(std::span<const Ray> rays, std::size_t stride) {
  std::vector<float> reals(3 * stride);
  for (std::size_t i = 0; i < stride; ++i) {
    const Ray& ray = rays[std::min(i, rays.size() - 1)];
    reals[i] = static_cast<float>(ray.column) + 0.5F;
    reals[stride + i] = static_cast<float>(ray.row) + 0.5F;
    reals[2 * stride + i] = ray.hint;
  }
  return reals;
}

class MarchSource : public DepthSource {
 public:
  MarchSource(const Device& device, const RationalMap& map, int iterations)
      : device_(device), map_(map), iterations_(iterations), stops_(find_stop_radii(device, map)) {
    device::Context& context = device.context();
    radius_ = 1.001 * std::min(stops_.outer, stops_.escape);
    buffer_ = upload_map(context, map, stops_, Precision::single);
    kernel_ = context.kernel("ray_march.cl", "march_depth",
                             {device.lane_width(Precision::single), Precision::single, {}});
    const double band =
        iterations == 1 ? map.surface_level : std::log(std::min(stops_.outer, stops_.escape));
    steepest_ =
        steepest_slope(Field(device, map, Precision::single, stops_), map.slice, band, shape_box());
  }

  std::vector<float> depths(const View& view, int first_row, int rows) override {
    if (view.samples == 1) return march_rows(view, first_row, rows);
    // One ray a pixel tells where a pixel's samples need rays of their own.
    const View coarse = view.coarse();
    const int from = std::max(0, first_row / view.samples - 1);
    const int to = std::min(coarse.rows, (first_row + rows - 1) / view.samples + 2);
    const DepthGrid pixels{coarse.columns, to - from, march_rows(coarse, from, to - from)};
    return refine(view, first_row, rows, from, pixels);
  }

  Box bounds() const override {
    // The shell reaches a little beyond the shape, and not beyond the ball.
    const Eigen::Vector3d margin = Eigen::Vector3d::Constant(2 / steepest_);
    const Eigen::Vector3d corner = Eigen::Vector3d::Constant(radius_);
    const Box box = shape_box();
    return {(box.low - margin).cwiseMax(-corner), (box.high + margin).cwiseMin(corner)};
  }

 private:
  /// The fitted shape's box, or where none is known, that of the ball.
  Box shape_box() const {
    const Eigen::Vector3d corner = Eigen::Vector3d::Constant(radius_);
    if (!map_.box) return {-corner, corner};
    return {map_.shape_to_map.to_map(map_.box->low), map_.shape_to_map.to_map(map_.box->high)};
  }

  /// Depths of the given rays, in their order.
  std::vector<float> march(const View& view, const std::vector<Ray>& rays) {
    device::Context& context = device_.context();
    const auto packed = context.upload<float>(view.packed());
    // Fine enough for what a pixel can show, and for the shell's own grain.
    const double shell = 1 / steepest_;
    const double step =
        std::clamp(view.footprint, shell / 40, view.for_shadows ? shell / 3 : shell / 6);
    const int iterations =
        view.for_shadows ? std::min(iterations_, kShadowIterations) : iterations_;
    const auto lanes = static_cast<std::size_t>(device_.lane_width(Precision::single));
    std::vector<float> depths(rays.size());
    std::vector<float> out_reals;
    for (std::size_t done = 0; done < rays.size();) {
      const auto part = std::span(rays).subspan(
          done, std::min(static_cast<std::size_t>(rays_a_launch_), rays.size() - done));
      const std::size_t groups = (part.size() + lanes - 1) / lanes, stride = groups * lanes;
      const auto in = context.upload<float>(component_arrays(part, stride));
      const auto out = context.allocate<float>(stride);
      const auto start = Clock::now();
      context.launch(kernel_, work_groups(groups, lanes),
                     {buffer_, static_cast<std::int32_t>(map_.factors.size()), iterations, packed,
                      in, static_cast<std::int32_t>(stride), static_cast<std::int32_t>(groups),
                      real(radius_), real(steepest_), real(step), real(view.tolerance), out});
      out_reals.resize(stride);
      context.read(out, std::span(out_reals));
      std::copy_n(out_reals.begin(), part.size(),
                  depths.begin() + static_cast<std::ptrdiff_t>(done));
      const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
      rays_a_launch_ = std::clamp(rays_a_launch_ * std::clamp(kLaunchSeconds / seconds, 0.5, 2.0),
                                  1024.0, 1048576.0);
      done += part.size();
    }
    return depths;
  }

  /// Every ray of these rows.
  std::vector<float> march_rows(const View& view, int first_row, int rows) {
    const auto rays = all_rays(view.columns, first_row, rows);
    const auto in_order = march(view, rays);
    std::vector<float> depths(in_order.size());
    for (std::size_t i = 0; i < rays.size(); ++i) {
      depths[index(rays[i].column, rays[i].row - first_row, view.columns)] = in_order[i];
    }
    return depths;
  }

  /// Depths of samples, given those of pixels from row `from` on.
  std::vector<float> refine(const View& view, int first_row, int rows, int from,
                            const DepthGrid& pixels) {
    const double pixel = view.footprint * view.samples;
    std::vector<float> depths(
        static_cast<std::size_t>(view.columns) * static_cast<std::size_t>(rows),
        static_cast<float>(QJ_NO_HIT));
    std::vector<Ray> rays;
    for (Ray ray : all_rays(view.columns, first_row, rows)) {
      const int i = ray.column / view.samples, j = ray.row / view.samples - from;
      const PixelKind kind = pixels.kind(i, j, pixel);
      if (kind == PixelKind::smooth) {
        depths[index(ray.column, ray.row - first_row, view.columns)] = pixels.interpolated(
            (ray.column + 0.5) / view.samples - 0.5, (ray.row + 0.5) / view.samples - 0.5 - from);
      } else if (kind == PixelKind::rough) {
        ray.hint = std::max(0.0F, pixels.nearest_around(i, j) - static_cast<float>(2 * pixel));
        rays.push_back(ray);
      }
    }
    const auto marched = march(view, rays);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      depths[index(rays[i].column, rays[i].row - first_row, view.columns)] = marched[i];
    }
    return depths;
  }

  /// Work-groups of a fixed size: a device may compile anew for each size it meets.
  static device::Range work_groups(std::size_t groups, std::size_t lanes) {
    const std::size_t size = lanes == 1 ? 64 : 1;
    return {{(groups + size - 1) / size * size, 1, 1}, {size, 1, 1}};
  }

  static device::Argument real(double value) {
    return device::Argument::real(value, Precision::single);
  }

  Device device_;
  RationalMap map_;
  int iterations_;
  StopRadii stops_;
  double radius_ = 0;    ///< of a ball about the origin that holds the set
  double steepest_ = 0;  ///< ‖∇F₁‖ about the undecided band
  device::RealBuffer buffer_;
  device::Kernel kernel_;
  double rays_a_launch_ = 4096;
};

}  // namespace

std::unique_ptr<DepthSource> march_source(const Device& device, const RationalMap& map,
                                          int iterations) {
  return std::make_unique<MarchSource>(device, map, iterations);
}

}  // namespace qjulia
