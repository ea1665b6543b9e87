#include "qjulia/field.hpp"

#include <algorithm>

#include "device/context.hpp"
#include "map/map_buffer.hpp"
#include "qjulia/shared/map_layout.h"

namespace qjulia {

using device::Context;

struct Field::Impl {
  Device device;
  Precision precision;
  int factors;
  device::RealBuffer map;

  /// Points per launch: keeps a launch near 100 ms and memory small on any device.
  static constexpr std::size_t kBlock = std::size_t{1} << 16;

  int width() const { return device.lane_width(precision); }
  device::Kernel kernel(const char* name) const {
    return device.context().kernel("field.cl", name, {width(), precision, {}});
  }

  /// Calls `run(points on the device, padded count, groups)` for each block, then `take`.
  template <class Run, class Take>
  void for_blocks(std::span<const Quaternion> points, Run run, Take take) const;
  std::vector<double> evaluate(std::span<const Quaternion> points, int iterations,
                               bool decided) const;
};

namespace {

/// X, Y, Z, W arrays of `stride` reals; the padding repeats the last point.
std::vector<double> component_arrays(std::span<const Quaternion> points, std::size_t stride) {
  std::vector<double> reals(4 * stride);
  for (std::size_t i = 0; i < stride; ++i) {
    const Quaternion& q = points[std::min(i, points.size() - 1)];
    reals[i] = q.x;
    reals[stride + i] = q.y;
    reals[2 * stride + i] = q.z;
    reals[3 * stride + i] = q.w;
  }
  return reals;
}

}  // namespace

template <class Run, class Take>
void Field::Impl::for_blocks(std::span<const Quaternion> points, Run run, Take take) const {
  Context& context = device.context();
  const auto lanes = static_cast<std::size_t>(width());
  for (std::size_t first = 0; first < points.size(); first += kBlock) {
    const auto block = points.subspan(first, std::min(kBlock, points.size() - first));
    const std::size_t groups = (block.size() + lanes - 1) / lanes;
    const std::size_t stride = groups * lanes;
    const auto buffer = context.upload_real(component_arrays(block, stride), precision);
    const auto result = run(buffer, stride, groups);
    std::vector<double> values(result.size());
    context.read(result, values);
    take(first, block.size(), stride, values);
  }
}

std::vector<double> Field::Impl::evaluate(std::span<const Quaternion> points, int iterations,
                                          bool decided) const {
  Context& context = device.context();
  const auto field_at_points = kernel("field_at_points");
  std::vector<double> field(points.size());
  for_blocks(
      points,
      [&](const device::RealBuffer& buffer, std::size_t stride, std::size_t groups) {
        auto out = context.allocate_real(stride, precision);
        context.launch(
            field_at_points, {{groups, 1, 1}},
            {buffer, static_cast<std::int32_t>(stride), static_cast<std::int32_t>(groups), map,
             factors, iterations, decided ? 1 : 0, out});
        return out;
      },
      [&](std::size_t first, std::size_t count, std::size_t, const std::vector<double>& values) {
        std::copy_n(values.begin(), count, field.begin() + static_cast<std::ptrdiff_t>(first));
      });
  return field;
}

Field::Field(const Device& device, const RationalMap& map, Precision precision,
             const StopRadii& stops)
    : impl_(std::make_shared<Impl>(Impl{device, precision, static_cast<int>(packed_factors(map)),
                                        upload_map(device.context(), map, stops, precision)})) {}

std::vector<double> Field::at(std::span<const Quaternion> points, int iterations) const {
  return impl_->evaluate(points, iterations, false);
}

std::vector<double> Field::decided_at(std::span<const Quaternion> points, int iterations) const {
  return impl_->evaluate(points, iterations, true);
}

std::vector<Quaternion> Field::gradient_at(std::span<const Quaternion> points) const {
  const Impl& impl = *impl_;
  Context& context = impl.device.context();
  const auto kernel = impl.kernel("field_gradient_at_points");
  std::vector<Quaternion> gradients(points.size());
  impl.for_blocks(
      points,
      [&](const device::RealBuffer& buffer, std::size_t stride, std::size_t groups) {
        auto out = context.allocate_real(4 * stride, impl.precision);
        context.launch(kernel, {{groups, 1, 1}},
                       {buffer, static_cast<std::int32_t>(stride),
                        static_cast<std::int32_t>(groups), impl.map, impl.factors, out});
        return out;
      },
      [&](std::size_t first, std::size_t count, std::size_t stride,
          const std::vector<double>& values) {
        for (std::size_t i = 0; i < count; ++i) {
          gradients[first + i] = {values[i], values[stride + i], values[2 * stride + i],
                                  values[3 * stride + i]};
        }
      });
  return gradients;
}

std::vector<Quaternion> on_slice(std::span<const Eigen::Vector3d> points, double slice) {
  std::vector<Quaternion> quaternions(points.size());
  std::ranges::transform(points, quaternions.begin(), [slice](const Eigen::Vector3d& x) {
    return Quaternion{x.x(), x.y(), x.z(), slice};
  });
  return quaternions;
}

}  // namespace qjulia
