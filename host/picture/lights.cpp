#include "picture/lights.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "layout/picture_layout.h"

namespace qjulia::picture {
namespace {

using Eigen::Vector3d;

// Texels along a side at full fineness of the maps of the sky's lights, the key light and other
// lamps, and of the coarsest map.
constexpr int kSkyMap = 160;
constexpr int kOtherMap = 384;
constexpr int kKeyMap = 768;
constexpr int kLeastMap = 64;
constexpr int kFloorCones = 1024;  ///< parts of an environment that light a floor
/// The irradiance of a surface that faces a white lamp of strength 1.
constexpr double kLampLight = 1.35;

// Of the studio, per steradian: a sky brightest overhead, cool; a floor that glows warmly with the
// light it has got.
const Vector3d kZenith(0.22, 0.235, 0.26), kHorizon(0.12, 0.13, 0.145), kFloor(0.085, 0.078, 0.068);

Vector3d fill_of(const Rig& rig) { return rig.fill * rig.fill_color.linear(); }

Vector3d light_of(const Lamp& lamp) { return lamp.strength * kLampLight * lamp.color.linear(); }

/// What comes from a direction whose sine of elevation is `rise`, per steradian.
Vector3d sent_from(const Surroundings& around, double rise) {
  return rise > 0 ? Vector3d(around.horizon + rise * (around.zenith - around.horizon))
                  : around.floor;
}

Vector3d placed(const CameraAxes& axes, const Vector3d& v) {
  return v.x() * axes.right + v.y() * axes.up + v.z() * axes.back;
}

/// The irradiance of a level floor with nothing in the way.
Vector3d on_floor(const Rig& rig, const Surrounded* around) {
  Vector3d sum = Vector3d::Zero();
  if (around != nullptr) {
    const auto add = [&](const Cone& cone) { sum += std::max(0.0, cone.towards.y()) * cone.color; };
    for (const Cone& cone : cones_of(around->light.sky, kFloorCones)) add(cone);
    if (around->light.sun) add(*around->light.sun);
    sum = sum.cwiseProduct(fill_of(rig));
  } else {
    const Surroundings open = surroundings_of(rig);
    sum = std::numbers::pi * (open.horizon + 2.0 / 3 * (open.zenith - open.horizon));
  }
  for (const Lamp& lamp : rig.lamps) {
    sum += std::max(0.0, std::sin(lamp.elevation * kDegree)) * light_of(lamp);
  }
  return sum;
}

/// A light of the sky stands for a little of its neighbours' parts, too, so that shadows run into
/// one another: the tangent of its angular radius.
double sky_softness(double steradians) {
  constexpr double kOverlap = 1.2, kLeastCosine = 0.25;
  const double cosine = std::max(1 - steradians / (2 * std::numbers::pi), kLeastCosine);
  return kOverlap * std::sqrt(1 - cosine * cosine) / cosine;
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

Surroundings surroundings_of(const Rig& rig) {
  const Vector3d fill = fill_of(rig);
  return {kZenith.cwiseProduct(fill), kHorizon.cwiseProduct(fill), kFloor.cwiseProduct(fill)};
}

Vector3d wall_light(const Rig& rig, const Surrounded* around) {
  return rig.wall *
         on_floor(rig, around).cwiseQuotient(on_floor(rig_named(RigName::studio), nullptr));
}

std::vector<Light> sky_lights(const Rig& rig, const Surrounded* around, UpAxis up, const Box& held,
                              double fineness, int count) {
  const int size = map_size(kSkyMap, std::sqrt(fineness));
  std::vector<Light> lights;
  const auto add = [&](const Vector3d& towards, const Vector3d& color, double steradians) {
    lights.push_back(
        {towards, color, sky_softness(steradians), parallel_view(towards, held, size)});
    lights.back().view.coarse_will_do = true;
  };
  if (around != nullptr) {
    const CameraAxes axes = around->axes(up);
    for (const Cone& cone : cones_of(around->light.sky, count)) {
      add(placed(axes, cone.towards), cone.color.cwiseProduct(fill_of(rig)), cone.steradians);
    }
    return lights;
  }
  const CameraAxes axes = camera_axes({.azimuth = 0, .elevation = 0, .up = up});
  const Surroundings open = surroundings_of(rig);
  // A Fibonacci spiral: nearly even over the sphere.
  for (int i = 0; i < count; ++i) {
    const double rise = 1 - (2 * i + 1.0) / count;
    const double turn = std::numbers::pi * (1 + std::sqrt(5.0)) * i;
    const double level_part = std::sqrt(1 - rise * rise);
    const double steradians = 4 * std::numbers::pi / count;
    add(placed(axes, {level_part * std::cos(turn), rise, level_part * std::sin(turn)}),
        steradians * sent_from(open, rise), steradians);
  }
  return lights;
}

std::vector<Light> lamp_lights(const Rig& rig, const Surrounded* around, double turn, UpAxis up,
                               const Box& held, double fineness) {
  const CameraAxes axes = camera_axes({.azimuth = turn, .elevation = 0, .up = up});
  std::vector<Light> lights;
  for (const Lamp& lamp : rig.lamps) {
    const double azimuth = lamp.azimuth * kDegree, elevation = lamp.elevation * kDegree;
    const Vector3d towards =
        placed(axes, {std::sin(azimuth) * std::cos(elevation), std::sin(elevation),
                      std::cos(azimuth) * std::cos(elevation)});
    lights.push_back({towards.normalized(), light_of(lamp), std::tan(lamp.size * kDegree), {}});
  }
  if (around != nullptr && around->light.sun) {
    const Cone& sun = *around->light.sun;
    const Vector3d color = sun.color.cwiseProduct(fill_of(rig));
    const bool is_key = lights.empty() || color.sum() > lights.front().color.sum();
    lights.insert(is_key ? lights.begin() : lights.end(),
                  {placed(around->axes(up), sun.towards),
                   color,
                   std::sqrt(sun.steradians / std::numbers::pi),
                   {}});
  }
  for (Light& light : lights) {
    const bool is_key = &light == &lights.front();
    light.view =
        parallel_view(light.towards, held, map_size(is_key ? kKeyMap : kOtherMap, fineness));
    light.view.coarse_will_do = !is_key;
  }
  return lights;
}

}  // namespace qjulia::picture
