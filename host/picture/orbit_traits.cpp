#include "picture/orbit_traits.hpp"

#include <array>

#include "device/point_batch.hpp"
#include "layout/picture_layout.h"
#include "qjulia/base/error.hpp"
#include "qjulia/picture/materials.hpp"

namespace qjulia::picture {
namespace {

constexpr int kCorners = 4;

/// The corners of a tetrahedron about a point, half a width away, each with the slice behind.
std::array<double, 16> corners_about(const Eigen::Vector3d& point, double width, double slice) {
  constexpr std::array<std::array<int, 3>, kCorners> kSigns{
      {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}}};
  const double away = 0.5 * width / std::sqrt(3.0);
  std::array<double, 16> corners{};
  for (std::size_t i = 0; i < kSigns.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      corners[4 * i + c] = point[static_cast<Eigen::Index>(c)] + away * kSigns[i][c];
    }
    corners[4 * i + 3] = slice;
  }
  return corners;
}

}  // namespace

std::vector<float> orbit_traits(const map::DeviceMap& map,
                                const std::vector<Eigen::Vector3d>& points,
                                std::span<const double> widths, int iterations, Material material,
                                const std::stop_token& stop) {
  if (facts_of(material).needs_factors && map.factors() == 0) {
    throw OptionError("material", "the map has no factors; give another material");
  }
  constexpr double kIterates = 8;  // that are run at a point, about: two at each corner
  device::PointBatch batch(map.context(), map.kernel("orbit_trait.cl", "orbit_trait"),
                           map.precision(), map.lanes(), map.step_cost() * kIterates);
  std::vector<float> traits(points.size());
  batch.run<16, 1>(
      points.size(),
      [&](std::size_t i) {
        return corners_about(points[i], widths[widths.size() == 1 ? 0 : i], map.slice());
      },
      [&](const device::PointBatch::Part& part) {
        return device::PartCall{
            {part.in, device::narrow(part.stride), device::narrow(part.items), map.buffer(),
             map.factors(), iterations, facts_of(material).trait, part.out},
            map.work(part.stride, kCorners * iterations * cost::kStep, 17, /*at_most=*/true)};
      },
      [&](std::size_t i, const std::array<double, 1>& trait) {
        traits[i] = static_cast<float>(trait[0]);
      },
      0, stop);
  return traits;
}

}  // namespace qjulia::picture
