#include "qjulia/field.hpp"

#include <algorithm>
#include <utility>

#include "base/range_check.hpp"
#include "device/point_batch.hpp"
#include "map/device_map.hpp"

namespace qjulia {

using namespace map;

using device::Argument;
using device::narrow;
using device::PointBatch;

namespace {

const Map& valid(const Map& map) {
  map.validate();
  return map;
}

}  // namespace

struct Field::Impl {
  DeviceMap map;
  std::stop_token stop;

  /// Hands `take` each point's number and what the kernel finds there.
  /// @param iterates of a point: what it costs. @param more arguments of the kernel.
  template <std::size_t kResults, class Take>
  void run(const char* kernel, std::span<const Quaternion> points, int iterates,
           const std::vector<Argument>& more, const Take& take) const {
    PointBatch batch(map.context(), map.kernel("field.cl", kernel), map.precision(), map.lanes(),
                     iterates == 1 ? map.modulus_cost() : map.step_cost() * iterates);
    batch.run<4, kResults>(
        points.size(), [&](std::size_t i) { return coordinates(points[i]); },
        [&](const PointBatch::Part& part) {
          std::vector<Argument> all{part.in, narrow(part.stride), narrow(part.items), map.buffer(),
                                    map.factors()};
          all.insert(all.end(), more.begin(), more.end());
          all.emplace_back(part.out);
          return all;
        },
        take, 0, stop);
  }

  std::vector<double> evaluate(std::span<const Quaternion> points, int iterations,
                               bool decided) const {
    base::expect_between("iterations", iterations, 1, kMostIterations);
    std::vector<double> field(points.size());
    run<1>("field_at_points", points, iterations, {iterations, decided ? 1 : 0},
           [&](std::size_t i, const std::array<double, 1>& f) { field[i] = f[0]; });
    return field;
  }
};

Field::Field(const Device& device, const Map& map, Precision precision, const StopRadii& stops,
             std::stop_token stop)
    : impl_(std::make_shared<Impl>(Impl{{device, valid(map), stops, precision}, std::move(stop)})) {
}

std::vector<double> Field::at(std::span<const Quaternion> points, int iterations) const {
  return impl_->evaluate(points, iterations, false);
}

std::vector<double> Field::decided_at(std::span<const Quaternion> points, int iterations) const {
  return impl_->evaluate(points, iterations, true);
}

std::vector<Quaternion> Field::gradient_at(std::span<const Quaternion> points) const {
  std::vector<Quaternion> gradients(points.size());
  impl_->run<4>("field_gradient_at_points", points, 1, {},
                [&](std::size_t i, const std::array<double, 4>& g) {
                  gradients[i] = {g[0], g[1], g[2], g[3]};
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
