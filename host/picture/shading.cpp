#include "picture/shading.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "layout/picture_layout.h"
#include "picture/depth_grid.hpp"

namespace qjulia::picture {
namespace {

using Eigen::Vector3d;

/// Depth differences, in footprints, at which a sample counts half for its neighbour's normal.
constexpr double kNormalSoftness = 5;

/// Number of the light with highlights and a penumbra.
constexpr int kKey = 0;

/// Work-groups of a fixed shape: a device may compile anew for each shape it meets.
device::Range tiles(int columns, int rows) {
  const auto padded = [](int count) { return (static_cast<std::size_t>(count) + 7) / 8 * 8; };
  return {{padded(columns), padded(rows), 1}, {8, 8, 1}};
}

static_assert(QJ_MOST_STOPS == Palette::kMostStops);

int number_of(Backdrop backdrop) {
  switch (backdrop) {
    case Backdrop::studio:
      return QJ_BACKDROP_STUDIO;
    case Backdrop::plain:
      return QJ_BACKDROP_PLAIN;
    case Backdrop::transparent:
      break;
  }
  return QJ_BACKDROP_NONE;
}

std::vector<float> packed(const Scene& scene, const GroundLight& ground) {
  std::vector<float> reals(QJ_SCENE_SIZE);
  const auto put = [&](std::size_t first, const Vector3d& v) {
    Eigen::Map<Eigen::Vector3f>(reals.data() + first) = v.cast<float>();
  };
  put(QJ_SCENE_UP, scene.up);
  put(QJ_SCENE_CENTER, scene.center);
  put(QJ_SCENE_RIGHT, ground.right);
  put(QJ_SCENE_FRONT, ground.front);
  put(QJ_SCENE_OPEN_SKY, ground.open);
  put(QJ_SCENE_COLOR, scene.color);
  put(QJ_SCENE_CLAY, scene.palette.clay);
  for (std::size_t i = 0; i < scene.palette.stops.size(); ++i) {
    put(QJ_SCENE_STOP + 3 * i, scene.palette.stops[i]);
  }
  reals[QJ_SCENE_STOPS] = static_cast<float>(scene.palette.stops.size());
  reals[QJ_SCENE_SIDE] = static_cast<float>(ground.side);
  reals[QJ_SCENE_BACKDROP] = static_cast<float>(number_of(scene.backdrop));
  reals[QJ_SCENE_GROUND] = scene.has_ground ? static_cast<float>(scene.ground) : QJ_NO_GROUND;
  reals[QJ_SCENE_RADIUS] = static_cast<float>(scene.radius);
  return reals;
}

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
  // Kernels find it back so: u of −1 … 1 lies at u / (1 − k |u|) radii.
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
  const auto shares = context.allocate<float>(count);
  const qj_light_arguments<float> arguments{.narrowest = 0,
                                            .receivers = static_cast<std::int32_t>(count),
                                            .ground = 0,
                                            .wide = ground.side,
                                            .samples = 1,
                                            .lights = static_cast<std::int32_t>(sky.size()),
                                            .key = -1};
  context.launch(
      kernel, {{count, 1, 1}, {}},
      {device::Argument::of(arguments), context.upload<float>(receivers),
       context.upload<float>(lights.reals), context.upload<float>(lights.atlas), shares});
  ground.shares.resize(count);
  context.read(shares, std::span(ground.shares));
  ground.shares = smoothed(ground.shares, static_cast<std::size_t>(ground.side));
  return ground;
}

Shading::Shading(const Device& device, const Scene& scene, const GroundLight& ground,
                 std::span<const Light> lights)
    : device_(device), lights_count_(static_cast<int>(lights.size())) {
  device::Context& context = device.context();
  const auto [reals, atlas] = packed(lights);
  lights_ = context.upload<float>(reals);
  key_ = context.upload<float>(
      std::span(reals).subspan(std::size_t{kKey} * QJ_LIGHT_SIZE, QJ_LIGHT_SIZE));
  maps_ = context.upload<float>(atlas);
  scene_ = context.upload<float>(packed(scene, ground));
  ground_ = context.upload<float>(ground.shares);
  const device::BuildOptions options{1, Precision::single, {}};
  normals_ = context.kernel("shade.cl", "normals_of_depth", options);
  sample_receivers_ = context.kernel("shade.cl", "sample_receivers", options);
  ground_receivers_ = context.kernel("shade.cl", "ground_receivers", options);
  sky_light_ = context.kernel("shade.cl", "sky_light", options);
  key_light_ = context.kernel("shade.cl", "key_light", options);
  pixels_ = context.kernel("shade.cl", "shade_pixels", options);
}

Shaded Shading::shade(const View& view, const Strip& strip, bool with_normals) const {
  device::Context& context = device_.context();
  const int wide = view.columns, deep = static_cast<int>(strip.depths.size()) / wide;
  const int columns = wide / strip.samples, sample_rows = strip.rows * strip.samples;
  const auto view_reals = context.upload_real(view.packed(), Precision::single);
  const auto depths = context.upload<float>(strip.depths);
  const auto normals = context.allocate<float>(3 * strip.depths.size());
  context.launch(
      normals_, tiles(wide, deep),
      {view_reals, wide, strip.first_row * strip.samples - strip.halo, deep, depths,
       device::Argument::real(kNormalSoftness * view.footprint, Precision::single), normals});
  const auto of_strip = device::Argument::of(
      qj_strip_arguments<float>{.columns = columns,
                                .rows_in_all = view.rows / strip.samples,
                                .first_row = strip.first_row,
                                .rows = strip.rows,
                                .samples = strip.samples,
                                .halo = strip.halo,
                                .has_traits = strip.traits.empty() ? 0 : 1,
                                .has_near_shadow = strip.near_shadow.empty() ? 0 : 1});
  const int samples = wide * sample_rows, pixels = columns * strip.rows;
  const auto of_light = device::Argument::of(
      qj_light_arguments<float>{.narrowest = static_cast<float>(strip.narrowest_penumbra),
                                .receivers = samples + pixels,
                                .ground = samples,
                                .wide = wide,
                                .samples = strip.samples,
                                .lights = lights_count_,
                                .key = kKey});
  const auto count = static_cast<std::size_t>(samples) + static_cast<std::size_t>(pixels);
  const auto receivers = context.allocate<float>(QJ_RECEIVER_SIZE * count);
  const auto received = context.allocate<float>(QJ_RECEIVED_SIZE * count);
  context.launch(sample_receivers_, tiles(wide, sample_rows),
                 {of_strip, view_reals, depths, normals, receivers});
  context.launch(ground_receivers_, tiles(columns, strip.rows),
                 {of_strip, view_reals, depths, scene_, receivers});
  context.launch(sky_light_, {{static_cast<std::size_t>(samples), 1, 1}, {}},
                 {of_light, receivers, lights_, maps_, received});
  const auto near_shadow = context.upload<std::uint8_t>(
      strip.near_shadow.empty() ? std::vector<std::uint8_t>(1) : strip.near_shadow);
  context.launch(key_light_, {{count, 1, 1}, {}},
                 {of_light, of_strip, near_shadow, receivers, lights_, maps_, received});
  const auto traits = context.upload<float>(strip.traits);
  const auto bytes = context.allocate<std::uint8_t>(4 * index(0, strip.rows, columns));
  context.launch(
      pixels_, tiles(columns, strip.rows),
      {of_strip, view_reals, depths, normals, traits, key_, scene_, ground_, received, bytes});
  Shaded shaded;
  std::vector<std::uint8_t> rgba(bytes.size());
  context.read(bytes, std::span(rgba));
  for (std::size_t i = 0; i < rgba.size(); i += 4) {
    for (std::size_t c = 0; c < 3; ++c) shaded.pixels.push_back(rgba[i + c]);
    shaded.alpha.push_back(rgba[i + 3]);
  }
  if (with_normals) {
    shaded.normals.resize(normals.size());
    context.read(normals, std::span(shaded.normals));
  }
  return shaded;
}

}  // namespace qjulia::picture
