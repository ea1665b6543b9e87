#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>

#include "device/context.hpp"
#include "map/map_buffer.hpp"
#include "picture/depth_source.hpp"
#include "qjulia/field.hpp"

namespace qjulia {
namespace {

using Clock = std::chrono::steady_clock;

/// Seconds a launch should take: work is cut into launches by how long the last one took.
constexpr double kLaunchSeconds = 0.05;

/// The first octaves of detail throw the shadows that can be seen.
constexpr int kShadowIterations = 2;

/// Nearly the greatest ‖∇F₁‖ where F₁ = level: the 95th percentile over points scattered in the
/// ball and led there by Newton's steps along the gradient.
double steepest_slope(const Field& field, double slice, double level, double radius) {
  std::mt19937_64 random(1);
  const auto uniform = [&] { return 2 * (static_cast<double>(random() >> 11) * 0x1p-53) - 1; };
  std::vector<Quaternion> points(4096);
  for (Quaternion& q : points)
    q = {radius * uniform(), radius * uniform(), radius * uniform(), slice};
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
  if (slopes.empty()) return 10 / radius;
  const auto at =
      slopes.begin() + static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(slopes.size()));
  std::ranges::nth_element(slopes, at);
  return *at;
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
        steepest_slope(Field(device, map, Precision::single, stops_), map.slice, band, radius_);
  }

  std::vector<float> depths(const View& view, int first_row, int rows) override {
    device::Context& context = device_.context();
    const auto packed = context.upload<float>(view.packed());
    // Fine enough for what a pixel can show, and for the shell's own grain.
    const double shell = 1 / steepest_;
    const double step = std::clamp(view.footprint, shell / 40, shell / 6);
    const int bisections =
        std::clamp(static_cast<int>(std::ceil(std::log2(step / view.tolerance))), 1, 12);
    const int iterations =
        view.for_shadows ? std::min(iterations_, kShadowIterations) : iterations_;
    std::vector<float> depths;
    depths.reserve(static_cast<std::size_t>(view.columns) * static_cast<std::size_t>(rows));
    for (int done = 0; done < rows;) {
      const int count = std::clamp(static_cast<int>(rays_a_launch_ / view.columns), 4, rows - done);
      const auto size = static_cast<std::size_t>(count) * static_cast<std::size_t>(view.columns);
      const auto out = context.allocate<float>(size);
      const auto start = Clock::now();
      context.launch(kernel_, blocks(view.columns, count),
                     {buffer_, static_cast<std::int32_t>(map_.factors.size()), iterations, packed,
                      view.columns, first_row + done, count, real(radius_), real(steepest_),
                      real(step), bisections, out});
      const std::size_t before = depths.size();
      depths.resize(before + size);
      context.read(out, std::span(depths).subspan(before));
      const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
      rays_a_launch_ =
          std::clamp(rays_a_launch_ * std::clamp(kLaunchSeconds / seconds, 0.5, 2.0), 256.0, 4e6);
      done += count;
    }
    return depths;
  }

  Box bounds() const override {
    const Eigen::Vector3d corner = Eigen::Vector3d::Constant(radius_);
    Box ball{-corner, corner};
    if (!map_.box) return ball;
    // The shell reaches a little beyond the shape, and not beyond the ball.
    const Eigen::Vector3d margin = Eigen::Vector3d::Constant(2 / steepest_);
    return {ball.low.cwiseMax(map_.shape_to_map.to_map(map_.box->low) - margin),
            ball.high.cwiseMin(map_.shape_to_map.to_map(map_.box->high) + margin)};
  }

 private:
  /// Work-items for blocks of pixels as the kernel cuts them, in work-groups of a fixed shape: one
  /// block of lanes, or 8 × 8 single pixels.
  device::Range blocks(int columns, int rows) const {
    const int width = device_.lane_width(Precision::single);
    const std::size_t across = width == 1 ? 1 : 4, down = static_cast<std::size_t>(width) / across;
    const std::size_t side = width == 1 ? 8 : 1;
    const auto fit = [&](int pixels, std::size_t block) {
      return (static_cast<std::size_t>(pixels) + block * side - 1) / (block * side) * side;
    };
    return {{fit(columns, across), fit(rows, down), 1}, {side, side, 1}};
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
