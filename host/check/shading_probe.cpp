#include "check/shading_probe.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "layout/picture_layout.h"
#include "picture/reflectance.hpp"

namespace qjulia::check {
namespace {

using Eigen::Vector3d;

std::vector<float> repeated(float value, std::size_t count) {
  return std::vector<float>(count, value);
}

qj_strip_arguments<float> row_of(std::size_t pixels, std::size_t lamps) {
  return {.columns = static_cast<std::int32_t>(pixels),
          .rows_in_all = 1,
          .first_row = 0,
          .rows = 1,
          .samples = 1,
          .halo = 0,
          .lamps = static_cast<std::int32_t>(lamps),
          .has_traits = 0,
          .has_near_shadow = 0,
          .has_parts = 0};
}

}  // namespace

std::vector<Rgb> ShadingProbe::radiance(const Device& device,
                                        std::span<const Vector3d> normals) const {
  device::Context& context = device.context();
  const std::size_t count = normals.size();
  picture::View view;
  view.dir = -Vector3d::UnitZ();
  std::vector<float> reals = picture::packed(scene, {});
  for (const int part : {QJ_SCENE_ZENITH, QJ_SCENE_HORIZON, QJ_SCENE_FLOOR}) {
    std::fill_n(reals.data() + part, 3, static_cast<float>(even_light));
  }
  std::vector<float> packed_normals;
  for (const Vector3d& n : normals) {
    for (const double c : n) packed_normals.push_back(static_cast<float>(c));
  }
  // Receivers: the points, and one of the ground for each.
  const auto sky = repeated(static_cast<float>(even_light), 2 * count * QJ_RECEIVED_SIZE);
  std::vector<float> seen;
  for (std::size_t i = 0; i < std::max<std::size_t>(1, 2 * count * lamps.size()); ++i) {
    seen.insert(seen.end(), {1.0F, 0.0F});
  }
  std::vector<float> lights = picture::packed(lamps).reals;
  lights.resize(std::max<std::size_t>(lights.size(), QJ_LIGHT_SIZE));
  const auto pixels = context.allocate<float>(count * QJ_PIXEL_SIZE);
  context.launch(
      context.kernel("develop.cl", "pixel_radiance", {1, Precision::single, {}}),
      {{count, 1, 1}, {}},
      {device::Argument::of(row_of(count, lamps.size())),
       context.upload_real(view.packed(), Precision::single),
       context.upload<float>(repeated(1, count)), context.upload<float>(packed_normals),
       context.upload<float>(repeated(0, 1)), context.upload<float>(lights),
       context.upload<float>(reals), context.upload<float>(picture::reflectance_table()),
       context.upload<float>(repeated(0, 1)), context.upload<float>(repeated(0, 1)),
       context.upload<float>(sky), context.upload<float>(seen),
       context.upload<float>(repeated(0, 1)), pixels, context.upload<float>(repeated(0, 1))},
      device::kNotCounted);
  std::vector<float> found(count * QJ_PIXEL_SIZE);
  context.read(pixels, std::span(found));
  std::vector<Rgb> radiances;
  for (std::size_t i = 0; i < count; ++i) {
    radiances.push_back(
        Eigen::Map<const Eigen::Vector3f>(found.data() + i * QJ_PIXEL_SIZE).cast<double>());
  }
  return radiances;
}

std::vector<std::uint8_t> developed(const Device& device, ToneCurve tone,
                                    std::span<const Rgb> radiances) {
  device::Context& context = device.context();
  picture::Scene scene;
  scene.options.tone = tone;
  std::vector<float> pixels;
  for (const Rgb& radiance : radiances) {
    for (const double c : radiance) pixels.push_back(static_cast<float>(c));
    pixels.insert(pixels.end(), {1.0F, 0.0F, 0.0F, 0.0F});  // they show nothing else
  }
  const auto bytes = context.allocate<std::uint16_t>(4 * radiances.size());
  context.launch(
      context.kernel("develop.cl", "develop_pixels", {1, Precision::single, {}}),
      {{radiances.size(), 1, 1}, {}},
      {device::Argument::of(row_of(radiances.size(), 0)),
       device::Argument::real(1, Precision::single), device::Argument::real(255, Precision::single),
       context.upload<float>(picture::packed(scene, {})), context.upload<float>(pixels), bytes},
      device::kNotCounted);
  std::vector<std::uint16_t> rgba(bytes.size());
  std::vector<std::uint8_t> rgb;
  context.read(bytes, std::span(rgba));
  for (std::size_t i = 0; i < rgba.size(); ++i) {
    if (i % 4 != 3) rgb.push_back(static_cast<std::uint8_t>(rgba[i]));
  }
  return rgb;
}

std::vector<picture::Light> even_lamps(int count) {
  std::vector<picture::Light> lamps;
  const Box around{Vector3d::Constant(-1), Vector3d::Constant(1)};
  for (int i = 0; i < count; ++i) {
    const double rise = 1 - (2 * i + 1.0) / count, level = std::sqrt(1 - rise * rise);
    const double turn = std::numbers::pi * (1 + std::sqrt(5.0)) * i;
    const Vector3d towards(level * std::cos(turn), level * std::sin(turn), rise);
    // 4 π / count steradians, divided by π as irradiance is in kernels.
    lamps.push_back(
        {towards, Vector3d::Constant(4.0 / count), 0, picture::parallel_view(towards, around, 1)});
  }
  return lamps;
}

}  // namespace qjulia::check
