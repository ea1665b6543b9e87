#include "picture/lights.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "layout/picture_layout.h"

namespace qjulia::picture {
namespace {

using Eigen::Vector3d;

// Texels along a side of a light's map at full fineness, and of the coarsest map.
constexpr int kSkyMap = 160;
constexpr int kRimMap = 384;
constexpr int kKeyMap = 768;
constexpr int kLeastMap = 64;
constexpr double kKeySoftness = 0.05;

/// What the surroundings send from a direction whose sine of elevation is `rise`, per steradian:
/// a sky brightest overhead, cool; a floor that glows warmly with the light it has got.
Vector3d surroundings(double rise) {
  const Vector3d horizon(0.12, 0.13, 0.145), zenith(0.22, 0.235, 0.26), floor(0.085, 0.078, 0.068);
  return rise > 0 ? Vector3d(horizon + rise * (zenith - horizon)) : floor;
}

int map_size(int full, double fineness) {
  return std::max(kLeastMap, static_cast<int>(std::lround(full * fineness)));
}

}  // namespace

PackedLights packed(std::span<const Light> lights) {
  PackedLights all{std::vector<float>(lights.size() * QJ_LIGHT_SIZE), {}};
  float* reals = all.reals.data();
  for (const Light& light : lights) {
    const View& view = light.view;
    const auto put = [&](std::size_t first, const Vector3d& v) {
      Eigen::Map<Eigen::Vector3f>(reals + first) = v.cast<float>();
    };
    const auto put_affine = [&](std::size_t first, const Vector3d& v) {
      put(first, v);
      reals[first + 3] = static_cast<float>(-v.dot(view.eye));
    };
    put(QJ_LIGHT_DIRECTION, light.towards);
    put(QJ_LIGHT_COLOR, light.color);
    put_affine(QJ_LIGHT_U, view.eye_dx / view.eye_dx.squaredNorm());
    put_affine(QJ_LIGHT_V, view.eye_dy / view.eye_dy.squaredNorm());
    put_affine(QJ_LIGHT_DEPTH, view.dir);
    reals[QJ_LIGHT_SOFTNESS] = static_cast<float>(light.softness);
    reals[QJ_LIGHT_TEXEL] = static_cast<float>(view.footprint);
    reals[QJ_LIGHT_MAP_SIZE] = static_cast<float>(view.columns);
    reals[QJ_LIGHT_MAP_FIRST] = static_cast<float>(all.atlas.size());
    reals += QJ_LIGHT_SIZE;
    all.atlas.insert(all.atlas.end(), light.depths.begin(), light.depths.end());
  }
  return all;
}

std::vector<Light> sky_lights(UpAxis up, const Box& held, double fineness, int count) {
  const CameraAxes axes = camera_axes({.azimuth = 0, .elevation = 0, .up = up});
  const int size = map_size(kSkyMap, std::sqrt(fineness));
  std::vector<Light> lights;
  // A Fibonacci spiral: nearly even over the sphere.
  for (int i = 0; i < count; ++i) {
    const double rise = 1 - (2 * i + 1.0) / count;
    const double around = std::numbers::pi * (1 + std::sqrt(5.0)) * i;
    const double level_part = std::sqrt(1 - rise * rise);
    const double steradians = 4 * std::numbers::pi / count;
    const Vector3d towards = level_part * std::cos(around) * axes.right + rise * axes.up +
                             level_part * std::sin(around) * axes.back;
    lights.push_back(
        {towards, steradians * surroundings(rise), 0, parallel_view(towards, held, size)});
    lights.back().view.coarse_will_do = true;
  }
  return lights;
}

LampLights lamps(const Camera& camera, const Lamp& key, const Box& held, double fineness) {
  Camera level = camera;
  level.elevation = 0;
  const CameraAxes axes = camera_axes(level);
  const auto from = [&](double right, double up, double back) -> Vector3d {
    return (right * axes.right + up * axes.up + back * axes.back).normalized();
  };
  const auto lamp = [&](const Vector3d& towards, const Vector3d& color, double softness, int size) {
    return Light{towards, color, softness, parallel_view(towards, held, map_size(size, fineness))};
  };
  const double azimuth = key.azimuth * kDegree, elevation = key.elevation * kDegree;
  const Vector3d towards = from(std::sin(azimuth) * std::cos(elevation), std::sin(elevation),
                                std::cos(azimuth) * std::cos(elevation));
  const Vector3d color = key.strength * Vector3d(1.35, 1.26, 1.10);
  LampLights lights{lamp(towards, color, kKeySoftness, kKeyMap),
                    lamp(from(0.75, 0.40, -0.60), {0.50, 0.54, 0.60}, 0, kRimMap)};
  lights.rim.view.coarse_will_do = true;
  return lights;
}

}  // namespace qjulia::picture
