#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>

#include "device/point_batch.hpp"
#include "layout/march.h"
#include "layout/picture_layout.h"
#include "map/device_map.hpp"
#include "picture/band_grid.hpp"
#include "picture/depth_grid.hpp"
#include "picture/depth_source.hpp"
#include "picture/grid_layout.hpp"
#include "picture/image_lattice.hpp"
#include "qjulia/error.hpp"

namespace qjulia::picture {
namespace {

/// What a ray costs, in iterates.
constexpr double kIteratesARay = 30;

/// Maps whose iterate costs less, in factors' logarithms, are not worth foretelling.
constexpr double kWorthForetelling = 150;
/// A lattice for the part of the band in sight is made where that is less than this share of it.
constexpr double kPart = 0.5;

/// For memory's sake: one for the lights, one for the camera.
constexpr std::size_t kMostLattices = 2;

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

/// A box about what rays of the view meet in `bounds`.
Box box_in_sight(const View& view, const Box& bounds) {
  const double middle = (bounds.center() - view.eye).norm(), reach = 0.5 * bounds.diagonal();
  Box sight{Eigen::Vector3d::Constant(1e30), Eigen::Vector3d::Constant(-1e30)};
  for (const double x : {0.0, double(view.columns)}) {
    for (const double y : {0.0, double(view.rows)}) {
      const Eigen::Vector3d origin = view.eye + x * view.eye_dx + y * view.eye_dy;
      const Eigen::Vector3d direction = view.dir + x * view.dir_dx + y * view.dir_dy;
      // As far along the view's axis as the bounds reach.
      for (const double depth : {std::max(0.0, middle - reach), middle + reach}) {
        const Eigen::Vector3d p = origin + depth * direction;
        sight.low = sight.low.cwiseMin(p);
        sight.high = sight.high.cwiseMax(p);
      }
    }
  }
  return {sight.low.cwiseMax(bounds.low), sight.high.cwiseMin(bounds.high)};
}

/// A map's box in map coordinates, or where it knows none, one that holds most of its factors.
Box shape_box(const RationalMap& map) {
  if (map.box) return map.shape_to_map.to_map(*map.box);
  const Eigen::Vector3d corner = Eigen::Vector3d::Constant(2);
  return {-corner, corner};
}

class MarchSource : public DepthSource {
 public:
  MarchSource(const Device& device, const MarchedSet& set)
      : device_(device),
        iterations_(set.iterations),
        precision_(set.precision),
        material_(set.material),
        foretells_(set.foretells),
        displacement_(set.displacement),
        stop_(set.stop),
        band_(find_band(device, set, shape_box(set.map))),
        grid_(device, set, band_),
        device_map_(device, set.map, band_.stops, set.precision),
        kernel_(device_map_.kernel("ray_march.cl", "march_depth")) {
    // Copies in portals may be smaller than what the grid shows of where they stand.
    if (!set.keeps_loose && !grid_.is_empty() && set.map.portals.empty()) find_loose(set);
    loose_layout_ = device.context().upload_real(grid_layout(loose_.grid), precision_);
    // A kernel's buffer has a size.
    if (loose_.bits.empty()) loose_.bits.push_back(0);
    loose_bits_ = device.context().upload<std::uint32_t>(loose_.bits);
  }

  void stop_with(const std::stop_token& stop) override { stop_ = stop; }

  std::vector<float> depths(const View& view, int first_row, int rows) override {
    if (grid_.is_empty()) {
      return std::vector<float>(
          static_cast<std::size_t>(view.columns) * static_cast<std::size_t>(rows),
          static_cast<float>(QJ_NO_HIT));
    }
    if (view.coarse_will_do) return grid_.depths(view, first_row, rows);
    if (view.samples == 1) return march_rows(view, first_row, rows);
    // One ray a pixel tells where a pixel's samples need rays of their own.
    const View coarse = view.coarse();
    const int from = std::max(0, first_row / view.samples - 1);
    const int to = std::min(coarse.rows, (first_row + rows - 1) / view.samples + 2);
    const DepthGrid pixels{coarse.columns, to - from, march_rows(coarse, from, to - from)};
    return refine(view, first_row, rows, from, pixels);
  }

  void prepare(const View& view) override {
    if (!grid_.is_empty()) lattice_for(view);
  }

  std::vector<float> traits(const std::vector<double>& points) override {
    if (material_ == Material::clay) return {};
    const std::size_t all = points.size() / 3;
    device::PointBatch batch(device_.context(), device_map_.kernel("orbit_trait.cl", "orbit_trait"),
                             precision_, device_map_.lanes(),
                             device_map_.step_cost() * iterations_);
    std::vector<float> traits(all);
    batch.run<3, 1>(
        all,
        [&](std::size_t i) {
          return std::array{points[i], points[all + i], points[2 * all + i]};
        },
        [&](const device::PointBatch::Part& part) {
          return std::vector<device::Argument>{part.in,
                                               device::narrow(part.stride),
                                               device::narrow(part.items),
                                               device_map_.buffer(),
                                               device_map_.factors(),
                                               iterations_,
                                               material_ == Material::trap ? 1 : 0,
                                               part.out};
        },
        [&](std::size_t i, const std::array<double, 1>& trait) {
          traits[i] = static_cast<float>(trait[0]);
        },
        0, stop_);
    return traits;
  }

  Box bounds() const override { return grid_.bounds(); }

  LoosePieces loose_pieces() const override { return loose_.pieces; }

 private:
  void find_loose(MarchedSet set) {
    if (set.part) {
      // What is cut away may be what a piece hangs on.
      set.part.reset();
      loose_ = BandGrid(device_, set, band_).loose_places(set.finest_cells, set.stop);
    } else {
      loose_ = grid_.loose_places(set.finest_cells, set.stop);
    }
    grid_.leave_out(loose_);
  }

  /// What serves the view's rays; made at the first call.
  const ImageLattice& lattice_for(const View& view) {
    const double displacement = displacement_ * view.footprint * view.samples;
    Box box = box_in_sight(view, grid_.bounds());
    if (!foretells_ || !device_map_.interpolates() || device_map_.step_cost() < kWorthForetelling ||
        iterations_ == 1 || (box.size().array() <= 0).any()) {
      if (lattices_.empty()) lattices_.emplace_back(device_map_);
      return lattices_.front();
    }
    const auto found = std::ranges::find_if(
        lattices_, [&](const ImageLattice& made) { return made.serves(box, displacement); });
    if (found != lattices_.end()) return *found;
    if (box.size().prod() > kPart * grid_.bounds().size().prod()) box = grid_.bounds();
    if (lattices_.size() == kMostLattices) lattices_.pop_front();
    return lattices_.emplace_back(device_map_, grid_, box, displacement, band_.steepest);
  }

  /// Depths of the given rays, in their order.
  std::vector<float> march(const View& view, const std::vector<Ray>& rays) {
    device::Context& context = device_.context();
    const auto packed = context.upload_real(view.packed(), precision_);
    // Fine enough for what a pixel can show, and for the shell's own grain.
    const double shell = 1 / band_.steepest;
    const double finest = finest_step(view);
    // Copies in portals have finer grain than any shell: there pixels alone decide.
    const double grain = device_map_.has_portals() ? 0 : shell / 40;
    const double step = std::max(finest, std::clamp(view.footprint, grain, shell / 6));
    const double tolerance = std::max(finest, view.tolerance);
    if (grid_.step() < 4 * finest) {
      throw Error(fmt::format(
          "the set is too small for its distance of {:.2g} from the eye or the map's origin to be "
          "drawn in {} precision",
          view.eye.norm() + band_.radius, to_string(precision_)));
    }
    const ImageLattice& lattice = lattice_for(view);
    const std::size_t share = kRaysALane * device_map_.lanes();
    device::PointBatch batch(context, kernel_, precision_, share,
                             device_map_.step_cost() * kIteratesARay);
    std::vector<float> depths(rays.size());
    batch.run<3, 1>(
        rays.size(),
        [&](std::size_t i) {
          const Ray& ray = rays[i];
          return std::array{ray.column + 0.5, ray.row + 0.5, double{ray.hint}};
        },
        [&](const device::PointBatch::Part& part) {
          const auto march = device::arguments(precision_, [&](auto r) {
            using real = decltype(r);
            return qj_march<real>{.radius = real(band_.radius),
                                  .steepest = real(band_.steepest),
                                  .shortest = real(step),
                                  .tolerance = real(tolerance),
                                  .iterations = iterations_,
                                  .stride = device::narrow(part.stride),
                                  .count = device::narrow(part.count),
                                  .share = device::narrow(share)};
          });
          return std::vector<device::Argument>{device_map_.buffer(),
                                               device_map_.factors(),
                                               march,
                                               packed,
                                               part.in,
                                               grid_.layout(),
                                               grid_.safe(),
                                               lattice.layout(),
                                               lattice.field(),
                                               lattice.versors(),
                                               lattice.trusted(),
                                               loose_layout_,
                                               loose_bits_,
                                               part.out};
        },
        [&](std::size_t i, const std::array<double, 1>& depth) {
          depths[i] = static_cast<float>(depth[0]);
        },
        device_map_.lanes() == 1 ? 64 : 1, stop_);
    return depths;
  }

  /// The least difference between depths that rounding leaves, with a margin: rays that took
  /// shorter steps, or were bisected further, would never end.
  double finest_step(const View& view) const {
    const double farthest = view.eye.norm() + band_.radius;
    return farthest * (precision_ == Precision::dbl ? 0x1p-50 : 0x1p-21);
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

  Device device_;
  int iterations_;
  Precision precision_;
  Material material_;
  bool foretells_;
  double displacement_;
  std::stop_token stop_;
  Band band_;
  BandGrid grid_;
  surface::LoosePlaces loose_;
  map::DeviceMap device_map_;
  device::Kernel kernel_;
  device::RealBuffer loose_layout_;
  device::Buffer<std::uint32_t> loose_bits_;
  std::deque<ImageLattice> lattices_;
};

}  // namespace

std::unique_ptr<DepthSource> march_source(const Device& device, const MarchedSet& set) {
  return std::make_unique<MarchSource>(device, set);
}

}  // namespace qjulia::picture
