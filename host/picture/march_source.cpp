#include <algorithm>
#include <chrono>
#include <cmath>

#include "device/context.hpp"
#include "map/map_buffer.hpp"
#include "picture/band_grid.hpp"
#include "picture/depth_grid.hpp"
#include "picture/depth_source.hpp"
#include "qjulia/shared/picture_layout.h"

namespace qjulia {
namespace {

using Clock = std::chrono::steady_clock;

/// Seconds a launch should take: work is cut into launches by how long the last one took.
constexpr double kLaunchSeconds = 0.08;

/// Factors of first iterates in a launch that colours points: about 50 ms on two cores.
constexpr std::size_t kFactorsALaunch = std::size_t{1} << 24;

/// Rays that each lane takes in turn, so that lanes whose rays end early are not idle.
constexpr std::size_t kRaysALane = 16;

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

/// x, y and hint arrays.
std::vector<double> component_arrays(std::span<const Ray> rays) {
  const std::size_t stride = rays.size();
  std::vector<double> reals(3 * stride);
  for (std::size_t i = 0; i < stride; ++i) {
    const Ray& ray = rays[i];
    reals[i] = ray.column + 0.5;
    reals[stride + i] = ray.row + 0.5;
    reals[2 * stride + i] = ray.hint;
  }
  return reals;
}

/// A map's box in map coordinates, or where it knows none, one that holds most of its factors.
Box shape_box(const RationalMap& map) {
  if (map.box)
    return {map.shape_to_map.to_map(map.box->low), map.shape_to_map.to_map(map.box->high)};
  const Eigen::Vector3d corner = Eigen::Vector3d::Constant(2);
  return {-corner, corner};
}

class MarchSource : public DepthSource {
 public:
  MarchSource(const Device& device, const MarchedSet& set)
      : device_(device),
        map_(set.map),
        iterations_(set.iterations),
        precision_(set.precision),
        material_(set.material),
        band_(find_band(device, set, shape_box(set.map))),
        grid_(device, set, band_) {
    device::Context& context = device.context();
    buffer_ = upload_map(context, map_, band_.stops, precision_);
    kernel_ = context.kernel("ray_march.cl", "march_depth",
                             {device.lane_width(precision_), precision_, {}});
  }

  std::vector<float> depths(const View& view, int first_row, int rows) override {
    if (view.coarse_will_do) return grid_.depths(view, first_row, rows);
    if (view.samples == 1) return march_rows(view, first_row, rows);
    // One ray a pixel tells where a pixel's samples need rays of their own.
    const View coarse = view.coarse();
    const int from = std::max(0, first_row / view.samples - 1);
    const int to = std::min(coarse.rows, (first_row + rows - 1) / view.samples + 2);
    const DepthGrid pixels{coarse.columns, to - from, march_rows(coarse, from, to - from)};
    return refine(view, first_row, rows, from, pixels);
  }

  std::vector<float> traits(const std::vector<double>& points) override {
    if (material_ == Material::clay) return {};
    const std::size_t all = points.size() / 3;
    device::Context& context = device_.context();
    const int width = device_.lane_width(precision_);
    const auto lanes = static_cast<std::size_t>(width);
    const auto kernel = context.kernel("orbit_trait.cl", "orbit_trait", {width, precision_, {}});
    const std::size_t most =
        std::max<std::size_t>(1, kFactorsALaunch / packed_factors(map_) / lanes) * lanes;
    std::vector<float> traits;
    for (std::size_t begin = 0; begin < all; begin += most) {
      const std::size_t count = std::min(most, all - begin);
      const std::size_t groups = (count + lanes - 1) / lanes;
      const std::size_t stride = groups * lanes;
      std::vector<double> sent(3 * stride);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        std::copy_n(points.begin() + static_cast<std::ptrdiff_t>(axis * all + begin), count,
                    sent.begin() + static_cast<std::ptrdiff_t>(axis * stride));
      }
      const auto out = context.allocate_real(stride, precision_);
      context.launch(
          kernel, {{groups, 1, 1}},
          {context.upload_real(sent, precision_), narrow(stride), narrow(groups), buffer_,
           narrow(packed_factors(map_)), iterations_, material_ == Material::trap ? 1 : 0, out});
      std::vector<double> found(count);
      context.read(out, found);
      for (const double trait : found) traits.push_back(static_cast<float>(trait));
    }
    return traits;
  }

  Box bounds() const override { return grid_.bounds(); }

 private:
  /// Depths of the given rays, in their order.
  std::vector<float> march(const View& view, const std::vector<Ray>& rays) {
    device::Context& context = device_.context();
    const auto packed = context.upload_real(view.packed(), precision_);
    // Fine enough for what a pixel can show, and for the shell's own grain.
    const double shell = 1 / band_.steepest;
    const double step = std::clamp(view.footprint, shell / 40, shell / 6);
    const auto lanes = static_cast<std::size_t>(device_.lane_width(precision_));
    const std::size_t share = kRaysALane * lanes;
    std::vector<float> depths(rays.size());
    for (std::size_t done = 0; done < rays.size();) {
      const auto part = std::span(rays).subspan(
          done, std::min(static_cast<std::size_t>(rays_a_launch_), rays.size() - done));
      const std::size_t stride = part.size();
      const auto in = context.upload_real(component_arrays(part), precision_);
      const auto out = context.allocate_real(stride, precision_);
      const auto start = Clock::now();
      const std::size_t items = (part.size() + share - 1) / share;
      context.launch(
          kernel_, work_groups(items, lanes),
          {buffer_, narrow(packed_factors(map_)), iterations_, packed, in, narrow(stride),
           narrow(part.size()), narrow(share), grid_.layout(), grid_.safe(), real(band_.radius),
           real(band_.steepest), real(step), real(view.tolerance), out});
      std::vector<double> found(part.size());
      context.read(out, found);
      std::ranges::transform(found, depths.begin() + static_cast<std::ptrdiff_t>(done),
                             [](double depth) { return static_cast<float>(depth); });
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
      const double x = (ray.column + 0.5) / view.samples - 0.5;
      const double y = (ray.row + 0.5) / view.samples - 0.5 - from;
      const PixelKind kind = pixels.kind(i, j, pixel);
      if (kind == PixelKind::smooth) {
        depths[index(ray.column, ray.row - first_row, view.columns)] = pixels.interpolated(x, y);
      } else if (kind == PixelKind::rough) {
        ray.hint = std::max(0.0F, pixels.nearest(x, y) - static_cast<float>(pixel));
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

  static std::int32_t narrow(std::size_t count) { return static_cast<std::int32_t>(count); }

  device::Argument real(double value) const { return device::Argument::real(value, precision_); }

  Device device_;
  RationalMap map_;
  int iterations_;
  Precision precision_;
  Material material_;
  Band band_;
  BandGrid grid_;
  device::RealBuffer buffer_;
  device::Kernel kernel_;
  double rays_a_launch_ = 4096;
};

}  // namespace

std::unique_ptr<DepthSource> march_source(const Device& device, const MarchedSet& set) {
  return std::make_unique<MarchSource>(device, set);
}

}  // namespace qjulia
