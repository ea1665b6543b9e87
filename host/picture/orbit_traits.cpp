#include "picture/orbit_traits.hpp"

#include <array>

#include "device/point_batch.hpp"

namespace qjulia::picture {

std::vector<float> orbit_traits(const map::DeviceMap& map,
                                const std::vector<Eigen::Vector3d>& points, int iterations,
                                Material material, const std::stop_token& stop) {
  device::PointBatch batch(map.context(), map.kernel("orbit_trait.cl", "orbit_trait"),
                           map.precision(), map.lanes(), map.step_cost() * iterations);
  std::vector<float> traits(points.size());
  batch.run<3, 1>(
      points.size(),
      [&](std::size_t i) {
        return std::array{points[i].x(), points[i].y(), points[i].z()};
      },
      [&](const device::PointBatch::Part& part) {
        return std::vector<device::Argument>(
            {part.in, device::narrow(part.stride), device::narrow(part.items), map.buffer(),
             map.factors(), iterations, material == Material::trap ? 1 : 0, part.out});
      },
      [&](std::size_t i, const std::array<double, 1>& trait) {
        traits[i] = static_cast<float>(trait[0]);
      },
      0, stop);
  return traits;
}

}  // namespace qjulia::picture
