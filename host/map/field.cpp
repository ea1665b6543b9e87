#include "qjulia/field.hpp"

#include <algorithm>
#include <utility>

#include "device/point_batch.hpp"
#include "map/device_map.hpp"

namespace qjulia {

using namespace map;

using device::Argument;
using device::narrow;
using device::PointBatch;

struct Field::Impl {
  DeviceMap map;
  std::stop_token stop;

  /// @param iterates of a point: what it costs.
  PointBatch batch(const char* kernel, int iterates) const {
    return {map.context(), map.kernel("field.cl", kernel), map.precision(), map.lanes(),
            iterates == 1 ? map.modulus_cost() : map.step_cost() * iterates};
  }
  std::vector<double> evaluate(std::span<const Quaternion> points, int iterations,
                               bool decided) const;
};

namespace {

auto coordinates_of(std::span<const Quaternion> points) {
  return [points](std::size_t i) { return coordinates(points[i]); };
}

}  // namespace

std::vector<double> Field::Impl::evaluate(std::span<const Quaternion> points, int iterations,
                                          bool decided) const {
  std::vector<double> field(points.size());
  batch("field_at_points", iterations)
      .run<4, 1>(
          points.size(), coordinates_of(points),
          [&](const PointBatch::Part& part) {
            return std::vector<Argument>{
                part.in,       narrow(part.stride), narrow(part.items), map.buffer(),
                map.factors(), iterations,          decided ? 1 : 0,    part.out};
          },
          [&](std::size_t i, const std::array<double, 1>& f) { field[i] = f[0]; }, 0, stop);
  return field;
}

Field::Field(const Device& device, const RationalMap& map, Precision precision,
             const StopRadii& stops, std::stop_token stop)
    : impl_(std::make_shared<Impl>(Impl{{device, map, stops, precision}, std::move(stop)})) {}

std::vector<double> Field::at(std::span<const Quaternion> points, int iterations) const {
  return impl_->evaluate(points, iterations, false);
}

std::vector<double> Field::decided_at(std::span<const Quaternion> points, int iterations) const {
  return impl_->evaluate(points, iterations, true);
}

std::vector<Quaternion> Field::gradient_at(std::span<const Quaternion> points) const {
  const DeviceMap& map = impl_->map;
  std::vector<Quaternion> gradients(points.size());
  impl_->batch("field_gradient_at_points", 1)
      .run<4, 4>(
          points.size(), coordinates_of(points),
          [&](const PointBatch::Part& part) {
            return std::vector<Argument>{part.in,      narrow(part.stride), narrow(part.items),
                                         map.buffer(), map.factors(),       part.out};
          },
          [&](std::size_t i, const std::array<double, 4>& g) {
            gradients[i] = {g[0], g[1], g[2], g[3]};
          },
          0, impl_->stop);
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
