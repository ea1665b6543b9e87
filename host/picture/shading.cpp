#include "picture/shading.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "layout/picture_layout.h"
#include "picture/depth_grid.hpp"
#include "picture/reflectance.hpp"

namespace qjulia::picture {
namespace {

using Eigen::Vector3d;

/// Depth differences, in footprints, at which a sample counts half for its neighbour's normal.
constexpr double kNormalSoftness = 5;

/// Work-groups of a fixed shape: a device may compile anew for each shape it meets.
device::Range tiles(int columns, int rows) {
  const auto padded = [](int count) { return (static_cast<std::size_t>(count) + 7) / 8 * 8; };
  return {{padded(columns), padded(rows), 1}, {8, 8, 1}};
}

double items_of(const device::Range& range) {
  return static_cast<double>(range.global[0] * range.global[1]);
}

/// Launches a kernel that moves so many reals in each work-item.
void launch_moving(device::Context& context, const device::Kernel& kernel,
                   const device::Range& range, std::initializer_list<device::Argument> arguments,
                   double reals) {
  context.launch(kernel, range, arguments, device::moving(reals * items_of(range)));
}

/// What each receiver and lamp takes (shade.cl): three coordinates in the lamp's map, cosine,
/// three colours.
device::LaunchWork sight_work(int receivers, int lamps, double reals) {
  constexpr double kSight = 3 * 3 + 3 + 3;
  const double count = receivers;
  return {count * lamps * kSight, count * (QJ_RECEIVER_SIZE + reals),
          /*is_at_most=*/true};
}

device::LaunchWork normals_work(int columns, int rows) {
  return device::moving(4.0 * columns * rows);
}

static_assert(QJ_MOST_STOPS == Palette::kMostStops);

int number_of(Backdrop backdrop) {
  switch (backdrop) {
    case Backdrop::studio:
      return QJ_BACKDROP_STUDIO;
    case Backdrop::plain:
      return QJ_BACKDROP_PLAIN;
    case Backdrop::environment:
      return QJ_BACKDROP_AROUND;
    case Backdrop::transparent:
      break;
  }
  return QJ_BACKDROP_NONE;
}

int number_of(ToneCurve tone) {
  switch (tone) {
    case ToneCurve::neutral:
      return QJ_TONE_NEUTRAL;
    case ToneCurve::agx:
      return QJ_TONE_AGX;
    case ToneCurve::aces:
      return QJ_TONE_ACES;
    case ToneCurve::none:
      break;
  }
  return QJ_TONE_NONE;
}

/// In radii of the shape: where light in wax of strength 1 has fallen to 1/e.
constexpr double kThin = 0.11;
/// For each radius, the logarithm of what fog of strength 1 leaves.
constexpr double kFog = -2.5;

constexpr int kSide = 160;  ///< points along a side at full fineness

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

std::vector<float> packed(const Scene& scene, const GroundLight& ground) {
  std::vector<float> reals(QJ_SCENE_SIZE);
  const auto put = [&](std::size_t first, const Vector3d& v) {
    Eigen::Map<Eigen::Vector3f>(reals.data() + first) = v.cast<float>();
  };
  const auto set = [&](std::size_t at, double value) { reals[at] = static_cast<float>(value); };
  put(QJ_SCENE_UP, scene.up);
  put(QJ_SCENE_CENTER, scene.center);
  put(QJ_SCENE_RIGHT, ground.right);
  put(QJ_SCENE_FRONT, ground.front);
  put(QJ_SCENE_OPEN_SKY, ground.open);
  put(QJ_SCENE_COLOR, scene.options.background.color);
  put(QJ_SCENE_WALL_LIGHT, wall_light(scene.rig, scene.around));
  put(QJ_SCENE_AROUND_RIGHT, scene.around_axes.right);
  put(QJ_SCENE_AROUND_BACK, scene.around_axes.back);
  // Irradiance is divided by pi in kernels, and so radiance is pi times as much.
  const Surroundings around = surroundings_of(scene.rig);
  put(QJ_SCENE_ZENITH, std::numbers::pi * around.zenith);
  put(QJ_SCENE_HORIZON, std::numbers::pi * around.horizon);
  put(QJ_SCENE_FLOOR, std::numbers::pi * around.floor);
  put(QJ_SCENE_CLAY, scene.options.palette.clay);
  for (std::size_t i = 0; i < scene.options.palette.stops.size(); ++i) {
    put(QJ_SCENE_STOP + 3 * i, scene.options.palette.stops[i]);
  }
  set(QJ_SCENE_STOPS, static_cast<double>(scene.options.palette.stops.size()));
  set(QJ_SCENE_SIDE, ground.side);
  set(QJ_SCENE_BACKDROP, number_of(scene.options.background.kind));
  set(QJ_SCENE_GROUND, scene.options.ground ? scene.ground_height : double{QJ_NO_GROUND});
  set(QJ_SCENE_RADIUS, scene.radius);
  const Matter& matter = scene.options.matter;
  set(QJ_SCENE_ROUGHNESS, matter.roughness);
  set(QJ_SCENE_METAL, matter.metal);
  set(QJ_SCENE_COAT, matter.coat);
  set(QJ_SCENE_SHEEN, matter.sheen);
  set(QJ_SCENE_WAX, matter.wax);
  set(QJ_SCENE_GLOW, matter.glow);
  set(QJ_SCENE_GLOW_FROM, matter.glow_from);
  set(QJ_SCENE_GLOW_FULL, matter.glow_full);
  set(QJ_SCENE_FOG, kFog * matter.fog);
  set(QJ_SCENE_TONE, number_of(scene.options.tone));
  return reals;
}

GroundLight ground_light(const Device& device, const Scene& scene, std::span<const Light> sky,
                         double fineness) {
  GroundLight ground;
  ground.side = static_cast<int>(std::lround(kSide * std::sqrt(fineness)));
  ground.right = scene.up.unitOrthogonal();
  ground.front = scene.up.cross(ground.right);
  const Vector3d middle =
      scene.center + (scene.ground_height - scene.center.dot(scene.up)) * scene.up;
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
  for (const Light& light : sky) {
    ground.open += std::max(0.0, light.towards.dot(scene.up)) * light.color;
  }
  const PackedLights lights = packed(sky);
  device::Context& context = device.context();
  const auto kernel = context.kernel("shade.cl", "ground_sky", {1, Precision::single, {}});
  const std::size_t count = receivers.size() / QJ_RECEIVER_SIZE;
  const auto shares = context.allocate<float>(count);
  const qj_light_arguments<float> arguments{.narrowest = 0,
                                            .thin = 0,
                                            .receivers = static_cast<std::int32_t>(count),
                                            .ground = 0,
                                            .wide = ground.side,
                                            .samples = 1,
                                            .lamps = 0,
                                            .lights = static_cast<std::int32_t>(sky.size()),
                                            .lamp = 0};
  context.launch(kernel, {{count, 1, 1}, {}},
                 {device::Argument::of(arguments), context.upload<float>(receivers),
                  context.upload<float>(lights.reals), context.upload<float>(lights.atlas), shares},
                 sight_work(arguments.receivers, arguments.lights, 1));
  ground.shares.resize(count);
  context.read(shares, std::span(ground.shares));
  ground.shares = smoothed(ground.shares, static_cast<std::size_t>(ground.side));
  return ground;
}

std::vector<float> normals_of(const Device& device, const View& view,
                              const std::vector<float>& depths) {
  device::Context& context = device.context();
  const auto normals = context.allocate<float>(3 * depths.size());
  context.launch(
      context.kernel("shade.cl", "normals_of_depth", {1, Precision::single, {}}),
      tiles(view.columns, view.rows),
      {context.upload_real(view.packed(), Precision::single), view.columns, 0, view.rows,
       context.upload<float>(depths),
       device::Argument::real(kNormalSoftness * view.footprint, Precision::single), normals},
      normals_work(view.columns, view.rows));
  std::vector<float> found(3 * depths.size());
  context.read(normals, std::span(found));
  return found;
}

Shading::Shading(const Device& device, const Scene& scene, const GroundLight& ground,
                 std::span<const Light> lamps, std::span<const Light> sky,
                 std::span<const std::vector<float>> bounces)
    : device_(device),
      lamps_count_(static_cast<int>(lamps.size())),
      lights_count_(static_cast<int>(lamps.size() + sky.size())),
      thin_(scene.options.matter.wax * kThin * scene.radius),
      bounce_(bounces.empty() ? 0 : scene.options.light.bounce) {
  device::Context& context = device.context();
  std::vector<Light> lights(lamps.begin(), lamps.end());
  lights.insert(lights.end(), sky.begin(), sky.end());
  auto [reals, atlas] = packed(lights);
  std::vector<float> texels(bounces.empty() ? 1 : 0);
  for (std::size_t i = 0; i < bounces.size(); ++i) {
    reals[i * QJ_LIGHT_SIZE + QJ_LIGHT_BOUNCE] = static_cast<float>(texels.size());
    texels.insert(texels.end(), bounces[i].begin(), bounces[i].end());
  }
  bounces_ = context.upload<float>(texels);
  lights_ = context.upload<float>(reals);
  maps_ = context.upload<float>(atlas);
  std::vector<float> reals_of_scene = packed(scene, ground);
  EnvironmentMaps around{0, 0, {0}};
  if (scene.around != nullptr) {
    around = environment_maps(scene.around->light, scene.rig.fill * scene.rig.fill_color.linear());
  }
  reals_of_scene[QJ_SCENE_BOUNCE] = static_cast<float>(bounce_);
  reals_of_scene[QJ_SCENE_AROUND_WIDTH] = static_cast<float>(around.width);
  reals_of_scene[QJ_SCENE_AROUND_HEIGHT] = static_cast<float>(around.height);
  scene_ = context.upload<float>(reals_of_scene);
  around_ = context.upload<float>(around.texels);
  ground_ = context.upload<float>(ground.shares);
  reflectance_ = context.upload<float>(reflectance_table());
  const device::BuildOptions options{1, Precision::single, {}};
  normals_ = context.kernel("shade.cl", "normals_of_depth", options);
  sample_receivers_ = context.kernel("shade.cl", "sample_receivers", options);
  ground_receivers_ = context.kernel("shade.cl", "ground_receivers", options);
  sky_light_ = context.kernel("shade.cl", "sky_light", options);
  lamp_light_ = context.kernel("shade.cl", "lamp_light", options);
  bounce_light_ = context.kernel("shade.cl", "bounce_light", options);
  radiance_ = context.kernel("develop.cl", "pixel_radiance", options);
  behind_ = context.kernel("develop.cl", "behind_pixels", options);
  develop_ = context.kernel("develop.cl", "develop_pixels", options);
  incident_ = context.kernel("develop.cl", "incident_light", options);
}

/// What receivers of a strip have got, on the device.
struct Shading::Received {
  device::Argument strip, light;  ///< arguments of kernels
  device::RealBuffer view;
  device::Buffer<float> depths, normals, receivers, sky, lamps, bounce;
};

Shading::Received Shading::receive(const View& view, const Strip& strip, bool with_parts) const {
  device::Context& context = device_.context();
  const int wide = view.columns, deep = static_cast<int>(strip.depths.size()) / wide;
  const int columns = wide / strip.samples, sample_rows = strip.rows * strip.samples;
  const int samples = wide * sample_rows, pixels = columns * strip.rows;
  const auto count = static_cast<std::size_t>(samples) + static_cast<std::size_t>(pixels);
  qj_light_arguments<float> light{.narrowest = static_cast<float>(strip.narrowest_penumbra),
                                  .thin = static_cast<float>(thin_),
                                  .receivers = samples + pixels,
                                  .ground = samples,
                                  .wide = wide,
                                  .samples = strip.samples,
                                  .lamps = lamps_count_,
                                  .lights = lights_count_,
                                  .lamp = 0};
  Received received{
      .strip = device::Argument::of(
          qj_strip_arguments<float>{.columns = columns,
                                    .rows_in_all = view.rows / strip.samples,
                                    .first_row = strip.first_row,
                                    .rows = strip.rows,
                                    .samples = strip.samples,
                                    .halo = strip.halo,
                                    .lamps = lamps_count_,
                                    .has_traits = strip.traits.empty() ? 0 : 1,
                                    .has_near_shadow = strip.near_shadow.empty() ? 0 : 1,
                                    .has_parts = with_parts ? 1 : 0}),
      .light = device::Argument::of(light),
      .view = context.upload_real(view.packed(), Precision::single),
      .depths = context.upload<float>(strip.depths),
      .normals = context.allocate<float>(3 * strip.depths.size()),
      .receivers = context.allocate<float>(QJ_RECEIVER_SIZE * count),
      .sky = context.allocate<float>(QJ_RECEIVED_SIZE * static_cast<std::size_t>(samples)),
      .lamps = context.allocate<float>(QJ_LAMP_SIZE * count *
                                       static_cast<std::size_t>(std::max(1, lamps_count_))),
      .bounce = context.allocate<float>(bounce_ > 0 ? 3 * static_cast<std::size_t>(samples) : 1)};
  context.launch(
      normals_, tiles(wide, deep),
      {received.view, wide, strip.first_row * strip.samples - strip.halo, deep, received.depths,
       device::Argument::real(kNormalSoftness * view.footprint, Precision::single),
       received.normals},
      normals_work(wide, deep));
  launch_moving(
      context, sample_receivers_, tiles(wide, sample_rows),
      {received.strip, received.view, received.depths, received.normals, received.receivers},
      4 + QJ_RECEIVER_SIZE);
  launch_moving(context, ground_receivers_, tiles(columns, strip.rows),
                {received.strip, received.view, received.depths, scene_, received.receivers},
                1 + QJ_RECEIVER_SIZE);
  context.launch(sky_light_, {{static_cast<std::size_t>(samples), 1, 1}, {}},
                 {received.light, received.receivers, lights_, maps_, received.sky},
                 sight_work(samples, lights_count_ - lamps_count_, QJ_RECEIVED_SIZE));
  const auto near_shadow = context.upload<std::uint8_t>(
      strip.near_shadow.empty() ? std::vector<std::uint8_t>(1) : strip.near_shadow);
  for (light.lamp = 0; light.lamp < lamps_count_; ++light.lamp) {
    launch_moving(context, lamp_light_, {{count, 1, 1}, {}},
                  {device::Argument::of(light), received.strip, near_shadow, received.receivers,
                   lights_, maps_, received.lamps},
                  QJ_RECEIVER_SIZE + QJ_LAMP_SIZE);
  }
  if (bounce_ > 0) {
    launch_moving(context, bounce_light_, {{static_cast<std::size_t>(samples), 1, 1}, {}},
                  {received.light, device::Argument::real(bounce_, Precision::single),
                   received.receivers, lights_, bounces_, received.bounce},
                  QJ_RECEIVER_SIZE + 3);
  }
  return received;
}

Shaded Shading::shade(const View& view, const Strip& strip, bool with_layers) const {
  device::Context& context = device_.context();
  const Received received = receive(view, strip, with_layers);
  const int columns = view.columns / strip.samples;
  const auto traits = context.upload<float>(strip.traits);
  const auto pixels = context.allocate<float>(QJ_PIXEL_SIZE * index(0, strip.rows, columns));
  const auto part_size = static_cast<std::size_t>(QJ_PART_LAMPS + 3 * lamps_count_);
  const auto parts =
      context.allocate<float>(with_layers ? part_size * index(0, strip.rows, columns) : 1);
  launch_moving(context, radiance_, tiles(columns, strip.rows),
                {received.strip, received.view, received.depths, received.normals, traits, lights_,
                 scene_, reflectance_, around_, ground_, received.sky, received.lamps,
                 received.bounce, pixels, parts},
                QJ_PIXEL_SIZE);
  Shaded shaded;
  shaded.pixels.resize(pixels.size());
  context.read(pixels, std::span(shaded.pixels));
  if (with_layers) {
    shaded.parts.resize(parts.size());
    context.read(parts, std::span(shaded.parts));
    shaded.normals.resize(received.normals.size());
    context.read(received.normals, std::span(shaded.normals));
  }
  return shaded;
}

namespace {

/// Whole rows of a picture.
qj_strip_arguments<float> rows_of_picture(std::span<const float> pixels, int first_row, int width,
                                          int height, int lamps) {
  return {.columns = width,
          .rows_in_all = height,
          .first_row = first_row,
          .rows = static_cast<int>(pixels.size() / QJ_PIXEL_SIZE) / width,
          .samples = 1,
          .halo = 0,
          .lamps = lamps,
          .has_traits = 0,
          .has_near_shadow = 0,
          .has_parts = 0};
}

}  // namespace

std::vector<float> Shading::behind(std::span<const float> pixels, int first_row, int width,
                                   int height, double exposure) const {
  device::Context& context = device_.context();
  const auto strip = rows_of_picture(pixels, first_row, width, height, lamps_count_);
  const auto light = context.allocate<float>(4 * pixels.size() / QJ_PIXEL_SIZE);
  launch_moving(context, behind_, tiles(width, strip.rows),
                {device::Argument::of(strip), device::Argument::real(exposure, Precision::single),
                 scene_, context.upload<float>(pixels), light},
                QJ_PIXEL_SIZE + 4);
  std::vector<float> found(light.size());
  context.read(light, std::span(found));
  return found;
}

std::vector<std::uint16_t> Shading::develop(std::span<const float> pixels, int first_row, int width,
                                            int height, double exposure, int most) const {
  device::Context& context = device_.context();
  const auto strip = rows_of_picture(pixels, first_row, width, height, lamps_count_);
  const auto numbers = context.allocate<std::uint16_t>(4 * pixels.size() / QJ_PIXEL_SIZE);
  launch_moving(context, develop_, tiles(width, strip.rows),
                {device::Argument::of(strip), device::Argument::real(exposure, Precision::single),
                 device::Argument::real(most, Precision::single), scene_,
                 context.upload<float>(pixels), numbers},
                QJ_PIXEL_SIZE + 1);
  std::vector<std::uint16_t> rgba(numbers.size());
  context.read(numbers, std::span(rgba));
  return rgba;
}

std::vector<float> Shading::incident(const View& view, const Strip& strip) const {
  device::Context& context = device_.context();
  const Received received = receive(view, strip, /*with_parts=*/false);
  const std::size_t count = index(0, strip.rows * strip.samples, view.columns);
  const auto light = context.allocate<float>(count);
  launch_moving(context, incident_, {{count, 1, 1}, {}},
                {received.light, received.receivers, lights_, received.sky, received.lamps, light},
                QJ_RECEIVER_SIZE + 1);
  std::vector<float> found(count);
  context.read(light, std::span(found));
  std::erase_if(found, [](float value) { return value < 0; });
  return found;
}

}  // namespace qjulia::picture
