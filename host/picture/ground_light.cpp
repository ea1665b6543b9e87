#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "device/context.hpp"
#include "layout/picture_layout.h"
#include "picture/shading.hpp"

namespace qjulia::picture {
namespace {

using Eigen::Vector3d;

constexpr int kSide = 160;  ///< points along a side at full fineness
/// A light's part of the sky and a little of its neighbours', so that shadows run into one another.
constexpr double kOverlap = 1.2;

/// The tangent of the angular radius of each of so many equal parts of the sphere.
double softness_of(std::size_t parts) {
  const double cosine = 1 - 2 / static_cast<double>(parts);
  return kOverlap * std::sqrt(1 - cosine * cosine) / cosine;
}

/// Each point's mean with its neighbours', by weights of 1, 2, 1 along rows and columns.
std::vector<float> smoothed(const std::vector<float>& points, std::size_t side) {
  const auto along = [side](const std::vector<float>& from, std::size_t stride,
                            std::size_t across) {
    std::vector<float> to(from.size());
    for (std::size_t line = 0; line < side; ++line) {
      const auto place = [&](std::size_t i) { return line * across + i * stride; };
      for (std::size_t i = 0; i < side; ++i) {
        const float before = from[place(i == 0 ? 0 : i - 1)];
        const float after = from[place(std::min(i + 1, side - 1))];
        to[place(i)] = 0.25F * (before + after) + 0.5F * from[place(i)];
      }
    }
    return to;
  };
  return along(along(points, 1, side), side, 1);
}

}  // namespace

GroundLight ground_light(const Device& device, const Scene& scene, std::vector<Light> sky,
                         double fineness) {
  GroundLight ground;
  ground.side = static_cast<int>(std::lround(kSide * std::sqrt(fineness)));
  ground.right = scene.up.unitOrthogonal();
  ground.front = scene.up.cross(ground.right);
  const Vector3d middle = scene.center + (scene.ground - scene.center.dot(scene.up)) * scene.up;
  // As kernels find it back: u of −1 … 1 lies at u / (1 − k |u|) radii.
  const auto place = [&](int i) {
    const double u = 2.0 * i / (ground.side - 1) - 1;
    return scene.radius * u / (1 - QJ_GROUND_CROWDING * std::abs(u));
  };
  std::vector<float> receivers;
  const auto put = [&](const Vector3d& v) {
    for (const double c : v) receivers.push_back(static_cast<float>(c));
  };
  for (int j = 0; j < ground.side; ++j) {
    for (int i = 0; i < ground.side; ++i) {
      put(middle + place(i) * ground.right + place(j) * ground.front);
      put(scene.up);
    }
  }
  for (Light& light : sky) {
    light.softness = softness_of(sky.size());
    ground.open += std::max(0.0, light.towards.dot(scene.up)) * light.color;
  }
  const PackedLights lights = packed(sky);
  device::Context& context = device.context();
  const auto kernel = context.kernel("shade.cl", "ground_sky", {1, Precision::single, {}});
  const std::size_t count = receivers.size() / QJ_RECEIVER_SIZE;
  const auto points = context.upload<float>(receivers);
  const auto sources = context.upload<float>(lights.reals);
  const auto depths = context.upload<float>(lights.atlas);
  const auto shares = context.allocate<float>(count);
  const qj_light_arguments<float> arguments{.receivers = static_cast<std::int32_t>(count),
                                            .ground = 0,
                                            .wide = ground.side,
                                            .samples = 1,
                                            .lights = static_cast<std::int32_t>(sky.size()),
                                            .key = -1};
  context.launch(kernel, {{count, 1, 1}, {}},
                 {device::Argument::of(arguments), points, sources, depths, shares});
  ground.shares.resize(count);
  context.read(shares, std::span(ground.shares));
  ground.shares = smoothed(ground.shares, static_cast<std::size_t>(ground.side));
  return ground;
}

}  // namespace qjulia::picture
