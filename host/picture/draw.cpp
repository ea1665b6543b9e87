#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

#include "layout/picture_layout.h"
#include "picture/bounce.hpp"
#include "picture/depth_grid.hpp"
#include "picture/lens.hpp"
#include "picture/near_shadow.hpp"
#include "picture/studio.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia {

using namespace picture;
namespace {

using Eigen::Vector3d;

constexpr int kHalo = 2;               ///< rows of samples that normals look beyond a strip
constexpr int kStripSamples = 400000;  ///< keeps memory small and launches short
constexpr int kFloorMap = 256;         ///< texels a side at full fineness
/// A draft has fewer sky lights, and coarser lamps.
constexpr int kSkyLights = 64, kDraftSkyLights = 16;
constexpr double kDraftLamps = 0.5;
/// What a sample of the picture, a texel of a light, and the band's grids cost, in marched rays.
constexpr double kSampleCost = 0.4, kCoarseCost = 0.05, kDepthGridCost = 3e5;
/// Views through a lens for each sample of a pixel; and while the camera moves, at least so many.
constexpr int kLensViews = 16, kFewestMoving = 8;
/// What radiance is multiplied by at an exposure of 0.
constexpr double kBaseExposure = 0.62;

/// The lowest point of the shape along `up`.
double lowest(DepthSource& source, const Vector3d& up, double fineness) {
  const Box bounds = source.bounds();
  const View view = parallel_view(-up, bounds, static_cast<int>(std::lround(kFloorMap * fineness)));
  double nearest = bounds.size().dot(up.cwiseAbs());
  for (const float depth : source.depths(view, 0, view.rows)) {
    if (depth >= 0) nearest = std::min(nearest, static_cast<double>(depth));
  }
  return view.eye.dot(up) + nearest;
}

/// What rows of a view see, point by point.
struct SeenPoints {
  std::vector<Vector3d> skin, faces;                    ///< of the set, and of cuts through it
  std::vector<std::size_t> skin_numbers, face_numbers;  ///< of their depths
};

/// @param depths of the view's rows from `first_row` on. @param part what cuts leave, if any.
SeenPoints seen_points(const View& view, int first_row, std::span<const float> depths,
                       const std::optional<Box>& part) {
  // Depths in single precision that differ by less than this share may be equal.
  constexpr double kRounding = 1e-5;
  SeenPoints seen;
  const auto wide = static_cast<std::size_t>(view.columns);
  for (std::size_t i = 0; i < depths.size(); ++i) {
    if (depths[i] < 0) continue;
    const int column = static_cast<int>(i % wide), row = first_row + static_cast<int>(i / wide);
    const double depth = double{depths[i]};
    const Vector3d point = view.at(column + 0.5, row + 0.5, depth);
    const double near = std::max(view.tolerance, kRounding * depth);
    const bool is_on_face = part && (((point - part->low).array().abs() < near).any() ||
                                     ((point - part->high).array().abs() < near).any());
    (is_on_face ? seen.faces : seen.skin).push_back(point);
    (is_on_face ? seen.face_numbers : seen.skin_numbers).push_back(i);
  }
  return seen;
}

/// Values of the material at points that stand for balls as wide as a pixel.
std::vector<float> traits_at(DepthSource& source, const Coloring& coloring,
                             const std::vector<Vector3d>& points, double pixel) {
  return material_traits([&](const auto& p, auto widths) { return source.traits(p, widths); },
                         coloring, points, std::span(&pixel, 1));
}

/// Adds the numbers to a layer.
template <class... Number>
void add_numbers(std::vector<float>& layer, Number... numbers) {
  (layer.push_back(static_cast<float>(numbers)), ...);
}

/// What is seen in the middles of the strip's pixels, added to `layers`.
void add_seen(const View& view, const Strip& strip, const std::vector<float>& normals,
              const ShapeToMap& to_scene, PictureLayers& layers) {
  constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();
  const int columns = view.columns / strip.samples;
  for (int row = 0; row < strip.rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const int i = column * strip.samples + strip.samples / 2;
      const int j = row * strip.samples + strip.samples / 2;
      const std::size_t sample = index(i, j + strip.halo, view.columns);
      const float depth = strip.depths[sample];
      if (!strip.traits.empty()) {
        add_numbers(layers.value, depth < 0 ? -1.0F : std::max(strip.traits[sample], -1.0F));
      }
      if (depth < 0) {
        add_numbers(layers.depth, std::numeric_limits<float>::infinity());
        add_numbers(layers.normal, 0, 0, 0);
        add_numbers(layers.position, kNothing, kNothing, kNothing);
        continue;
      }
      const double x = i + 0.5, y = strip.first_row * strip.samples + j + 0.5;
      const Vector3d point = to_scene.to_shape(view.at(x, y, double{depth}));
      add_numbers(layers.depth, double{depth} / to_scene.scale);
      const float* const normal = normals.data() + 3 * sample;
      add_numbers(layers.normal, normal[0], normal[1], normal[2]);
      add_numbers(layers.position, point.x(), point.y(), point.z());
    }
  }
}

/// Shares of the strip's pixels that show the shape, the ground and faces of cuts. @param ground
/// height along up; none: there is no ground.
void add_masks(const View& view, const Strip& strip, const std::optional<Box>& part,
               const Vector3d& up, std::optional<double> ground, PictureLayers& layers) {
  const int samples = strip.samples, columns = view.columns / samples;
  const int first_row = strip.first_row * samples - strip.halo;
  const SeenPoints seen = seen_points(view, first_row, strip.depths, part);
  std::vector<float> masks(3 * index(0, strip.rows, columns));
  const float each = 1.0F / static_cast<float>(samples * samples);
  const auto add = [&](std::size_t sample, std::size_t mask) {
    const int row = static_cast<int>(sample / static_cast<std::size_t>(view.columns)) - strip.halo;
    const int column = static_cast<int>(sample % static_cast<std::size_t>(view.columns));
    if (row < 0 || row >= strip.rows * samples) return;
    masks[3 * index(column / samples, row / samples, columns) + mask] += each;
  };
  for (const std::size_t sample : seen.skin_numbers) add(sample, 0);
  for (const std::size_t sample : seen.face_numbers) {
    add(sample, 0);
    add(sample, 2);
  }
  for (std::size_t i = 0; ground && i < strip.depths.size(); ++i) {
    if (strip.depths[i] >= 0) continue;
    const auto wide = static_cast<std::size_t>(view.columns);
    const std::size_t row = i / wide;
    const double x = static_cast<double>(i % wide) + 0.5;
    const double y = first_row + static_cast<double>(row) + 0.5;
    const bool is_below = view.direction(x, y).dot(up) < 0 && view.origin(x, y).dot(up) > *ground;
    if (is_below) add(i, 1);
  }
  layers.mask.insert(layers.mask.end(), masks.begin(), masks.end());
}

/// What light is made of in a strip's pixels, and what is behind the shape, added to `layers`.
void add_light(std::span<const float> pixels, std::span<const float> parts,
               std::span<const float> behind, double exposure, PictureLayers& layers) {
  const auto scale = static_cast<float>(exposure);
  const std::size_t count = pixels.size() / QJ_PIXEL_SIZE, size = parts.size() / count;
  const std::size_t lamps = (size - QJ_PART_LAMPS) / 3;
  if (layers.light.empty()) {
    for (std::size_t lamp = 1; lamp <= lamps; ++lamp) {
      layers.light.push_back({fmt::format("lamp{}", lamp), {}});
    }
    for (const char* name : {"sky", "bounce", "emission", "background"}) {
      layers.light.push_back({name, {}});
    }
  }
  const auto add = [&](std::vector<float>& layer, const float* color, float by) {
    add_numbers(layer, by * color[0], by * color[1], by * color[2]);
  };
  for (std::size_t i = 0; i < count; ++i) {
    const float* const pixel = pixels.data() + QJ_PIXEL_SIZE * i;
    const float* const part = parts.data() + size * i;
    const float* const back = behind.data() + 4 * i;
    for (std::size_t lamp = 0; lamp < lamps; ++lamp) {
      add(layers.light[lamp].color, part + QJ_PART_LAMPS + 3 * lamp, scale);
    }
    add(layers.light[lamps].color, part + QJ_PART_SKY, scale);
    add(layers.light[lamps + 1].color, part + QJ_PART_BOUNCE, scale);
    add(layers.light[lamps + 2].color, part + QJ_PART_GLOW, scale);
    add(layers.light[lamps + 3].color, back, 1);
    add(layers.albedo, part + QJ_PART_ALBEDO, 1);
    for (std::size_t c = 0; c < 3; ++c) {
      add_numbers(layers.beauty, scale * pixel[QJ_PIXEL_RADIANCE + c] + back[c]);
    }
    add_numbers(layers.beauty, back[3]);
  }
}

/// @param rgba numbers of so many bits.
void add_pixels(std::span<const std::uint16_t> rgba, bool has_alpha, int bits, Image& image) {
  const int less = bits - 8;
  for (std::size_t i = 0; i < rgba.size(); ++i) {
    const bool is_alpha = i % 4 == 3;
    if (is_alpha && !has_alpha) continue;
    (is_alpha ? image.alpha : image.pixels).push_back(static_cast<std::uint8_t>(rgba[i] >> less));
    if (less > 0) image.deep.push_back(rgba[i]);
  }
}

/// Pixels of the strip that have a sample on the surface.
std::size_t covered_pixels(const View& view, const Strip& strip) {
  const int columns = view.columns / strip.samples;
  std::vector<bool> covered(index(0, strip.rows, columns));
  for (int j = 0; j < strip.rows * strip.samples; ++j) {
    for (int i = 0; i < columns * strip.samples; ++i) {
      if (strip.depths[index(i, j + strip.halo, view.columns)] < 0) continue;
      covered[index(i / strip.samples, j / strip.samples, columns)] = true;
    }
  }
  return static_cast<std::size_t>(std::ranges::count(covered, true));
}

double view_cost(const View& view) {
  const double of_ray = view.coarse_will_do ? kCoarseCost : view.samples > 1 ? kSampleCost : 1;
  return double(view.columns) * view.rows * of_ray;
}

/// Some of the view's rays. What they show is as fine as the view's pixels.
View with_fewer_rays(const View& view, double rays) {
  View few = view;
  const double pixels = static_cast<double>(view.columns) * view.rows / rays;
  few.samples = std::clamp(static_cast<int>(std::lround(std::sqrt(pixels))), 1,
                           std::min(view.columns, view.rows));
  few = few.coarse();
  few.footprint = view.footprint * view.samples;
  few.tolerance = view.tolerance;
  return few;
}

}  // namespace

/// In the unit of `view_cost`.
struct Studio::Impl::Work {
  const ProgressMonitor& monitor;
  double all;
  double done = 0;
  std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();

  /// Reports progress. @throws Interrupted
  void did(double more) {
    throw_if_stopped(monitor.stop);
    done += more;
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    monitor.report(
        {"rendering", done / all, taken.count() * (all - done) / std::max(done, 1.0), {}});
  }
};

Studio::Impl::Sampled Studio::Impl::sampled(const View& view, double rays) {
  const View few = with_fewer_rays(view, rays);
  source->depths(view, 0, 1);
  return {few, source->depths(few, 0, few.rows)};
}

double Studio::Impl::metered(const View& view, const Shading& shading) {
  // What the studio's rig gives a ball.
  constexpr float kStudioLight = 1.54F;
  constexpr double kBrightShare = 0.85, kLeastLight = 1e-4;
  auto [few, depths] = sampled(view, kShownRays);
  few.footprint = view.footprint * view.columns / few.columns;  // normals look from ray to ray
  const Strip strip{.rows = few.rows, .samples = 1, .depths = std::move(depths)};
  std::vector<float> light = shading.incident(few, strip);
  if (light.empty()) return 0;
  const auto place =
      static_cast<std::ptrdiff_t>(kBrightShare * static_cast<double>(light.size() - 1));
  std::ranges::nth_element(light, light.begin() + place);
  return std::log2(kStudioLight /
                   std::max(double{light[static_cast<std::size_t>(place)]}, kLeastLight));
}

std::vector<float> Studio::Impl::shown(const View& view, double rays) {
  const auto [few, depths] = sampled(view, rays);
  return traits_at(*source, coloring, seen_points(few, 0, depths, faces()).skin, few.footprint);
}

std::vector<float> Studio::Impl::traits_of(const View& view, const Strip& strip) const {
  constexpr float kPlainClay = -1;
  if (!has_material() && !faces()) return {};
  const int first_row = strip.first_row * strip.samples - strip.halo;
  const SeenPoints seen = seen_points(view, first_row, strip.depths, faces());
  std::vector<float> traits(strip.depths.size(), kPlainClay);
  if (has_material()) {
    const std::vector<float> found =
        traits_at(*source, coloring, seen.skin, view.footprint * view.samples);
    for (std::size_t i = 0; i < found.size(); ++i) {
      traits[seen.skin_numbers[i]] = static_cast<float>(share_of(range, double{found[i]}));
    }
  }
  if (seen.faces.empty()) return traits;
  const std::vector<float> ways = source->ways_inside(seen.faces);
  for (std::size_t i = 0; i < ways.size(); ++i) {
    const auto stratum = static_cast<float>(stratum_at(double{ways[i]} / framed.diagonal()));
    traits[seen.face_numbers[i]] = has_material() ? stratum : -std::lerp(0.3F, 1.1F, stratum);
  }
  return traits;
}

std::vector<std::vector<float>> Studio::Impl::bounces(std::span<const Light> lamps) const {
  std::vector<std::vector<float>> all;
  if (options.light.bounce == 0) return all;
  for (const Light& lamp : lamps) {
    const LitSurface lit = lit_surface(lamp, normals_of(device, lamp.view, lamp.depths));
    const std::vector<float> traits =
        traits_of(lit.view, {.rows = lit.view.rows, .samples = 1, .depths = lit.depths});
    std::vector<Rgb> albedo(lit.depths.size(), options.palette.clay);
    for (std::size_t i = 0; i < traits.size(); ++i) {
      const auto place = static_cast<double>(traits[i]);
      albedo[i] = place < 0 ? -place * albedo[i] : color_at(options.palette, place);
    }
    all.push_back(bounce_levels(lit, albedo));
  }
  return all;
}

void Studio::Impl::light_sky(Work& work) {
  const TraceStage stage(work.monitor.trace, "sky");
  for (Light& light : sky) {
    take_depths(light);
    work.did(view_cost(light.view));
  }
  const Vector3d upward = direction(*options.camera.up);
  ground = own_ground ? to_scene.to_map(*own_ground * upward).dot(upward)
                      : lowest(*source, upward, fineness);
  ground_light =
      options.ground ? picture::ground_light(device, scene(), sky, fineness) : GroundLight{};
  up = options.camera.up;
}

Strip Studio::Impl::seen_strip(const View& view, SpecklessDepths& depths,
                               std::span<const Light> lamps, int row, int rows) const {
  const int samples = view.samples;
  // Near shadows look at the middles of the pixels beyond it, and a sample around each.
  const int halo = std::max(kHalo, samples / 2 + 2);
  const int from = std::max(0, row * samples - halo);
  const int to = std::min(view.rows, (row + rows) * samples + halo);
  Strip strip{.first_row = row, .rows = rows, .samples = samples, .halo = row * samples - from};
  strip.depths = depths.rows(from, to - from);
  if (!lamps.empty()) {
    strip.near_shadow = near_shadow(*source, view, lamps.front(), strip);
    strip.narrowest_penumbra = narrowest_penumbra(view, lamps.front());
  }
  return strip;
}

void Studio::Impl::draw(std::span<const View> views, std::span<const Light> lamps,
                        const Shading& shading, bool with_layers, Work& work,
                        LayeredImage& picture) const {
  Image& image = picture.image;
  const View& first = views.front();
  const int strip_rows = std::max(1, kStripSamples / (first.columns * first.samples));
  const auto share = 1 / static_cast<float>(views.size());
  std::vector<SpecklessDepths> depths;
  depths.reserve(views.size());
  for (const View& view : views) {
    depths.emplace_back(*source, view, SpecklessDepths::kSlab / views.size());
  }
  for (int row = 0; row < image.height; row += strip_rows) {
    const int rows = std::min(strip_rows, image.height - row);
    std::vector<float> pixels(QJ_PIXEL_SIZE * index(0, rows, image.width)), parts;
    for (std::size_t i = 0; i < views.size(); ++i) {
      const View& view = views[i];
      Strip strip;
      {
        const TraceStage stage(work.monitor.trace, "rays");
        strip = seen_strip(view, depths[i], lamps, row, rows);
      }
      strip.traits = traits_of(view, strip);
      throw_if_stopped(work.monitor.stop);
      const TraceStage stage(work.monitor.trace, "shade");
      const Shaded shaded = shading.shade(view, strip, with_layers);
      parts.resize(shaded.parts.size());
      const auto add = [share](const std::vector<float>& more, std::vector<float>& sums) {
        std::ranges::transform(sums, more, sums.begin(),
                               [&](float sum, float value) { return sum + share * value; });
      };
      add(shaded.pixels, pixels);
      add(shaded.parts, parts);
      if (i == 0) {
        image.covered += covered_pixels(view, strip);
        if (with_layers) {
          add_seen(view, strip, shaded.normals, to_scene, picture.layers);
          add_masks(view, strip, part, direction(*options.camera.up),
                    options.ground ? std::optional(ground) : std::nullopt, picture.layers);
        }
      }
      work.did(view_cost(view) * rows / image.height);
    }
    const double scale = kBaseExposure * std::exp2(exposure);
    const int most = (1 << options.bits) - 1;
    const std::vector<std::uint16_t> shown =
        shading.develop(pixels, row, image.width, image.height, scale, most);
    add_pixels(shown, options.background.kind == Backdrop::transparent, options.bits, image);
    if (with_layers) {
      add_light(pixels, parts, shading.behind(pixels, row, image.width, image.height, scale), scale,
                picture.layers);
    }
  }
}

std::vector<View> Studio::Impl::views_of(const Camera& camera, std::span<const Camera> moving) {
  const int samples = options.samples * options.samples;
  const bool has_lens = camera.aperture > 0;
  if (!has_lens && moving.empty()) return {view_of(camera)};
  const View still = view_of(camera).coarse();
  double focus = 1;  // any distance is as good for a pin-hole
  if (has_lens) {
    focus = camera.focus ? distance_along_axis(still, to_scene.to_map(*camera.focus))
                         : distance_in_focus(still);
    if (!(focus > 0)) throw OptionError("focus", "it lies behind the camera");
  }
  const int count = has_lens         ? kLensViews * samples
                    : moving.empty() ? samples
                                     : std::max(kFewestMoving, samples);
  std::vector<View> views;
  for (int i = 0; i < count; ++i) {
    View view = still;
    if (!moving.empty()) {
      const auto opened = static_cast<std::size_t>(open_part(i, count));
      // The middle of that part of the time.
      const std::size_t moment =
          (2 * opened + 1) * moving.size() / (2 * static_cast<std::size_t>(count));
      view = view_of(standing(moving[moment])).coarse();
      view.footprint = still.footprint;
      view.tolerance = still.tolerance;
    }
    views.push_back(lens_view(view, camera.aperture, focus, i, count));
    views.back().lens_eye = still.eye;  // what is looked up for that eye serves all
  }
  return views;
}

double Studio::Impl::distance_in_focus(const View& view) {
  const auto [few, depths] = sampled(view, kShownRays);
  double nearest = std::numeric_limits<double>::infinity();
  Vector3d seen = framed.center();
  for (int row = 0; row < few.rows; ++row) {
    for (int column = 0; column < few.columns; ++column) {
      const float depth = depths[index(column, row, few.columns)];
      const double x = column + 0.5, y = row + 0.5;
      const double away = std::hypot(x - 0.5 * few.columns, y - 0.5 * few.rows);
      if (depth < 0 || away >= nearest) continue;
      nearest = away;
      seen = few.at(x, y, double{depth});
    }
  }
  return distance_along_axis(view, seen);
}

LayeredImage Studio::Impl::picture(const ProgressMonitor& monitor, bool with_layers,
                                   std::span<const Camera> moving) {
  source->stop_with(monitor.stop.stop_possible() ? monitor.stop : stop);
  options.camera = aimed(std::span(&options.camera, 1), {}).front();
  const Camera& camera = options.camera;
  const View view = view_of(camera);
  rig = options.light.whole();
  const bool is_first = up != camera.up;
  std::vector<Light> placed = lamp_lights(
      rig, environment ? &*environment : nullptr, options.light.lamp_turn.value_or(camera.azimuth),
      *camera.up, source->bounds(), fineness * (is_draft ? kDraftLamps : 1));
  if (is_first) kept_lamps.clear();
  const bool have_moved =
      !std::ranges::equal(placed, kept_lamps, {}, &Light::towards, &Light::towards);
  double cost_of_lamps = 0;
  for (const Light& lamp : placed) cost_of_lamps += have_moved ? view_cost(lamp.view) : 0;
  Work work{monitor, view_cost(view) + cost_of_lamps};
  if (is_first) {
    up.reset();  // a stop may come before all is there
    sky = sky_lights(rig, environment ? &*environment : nullptr, *camera.up, source->bounds(),
                     fineness, is_draft ? kDraftSkyLights : kSkyLights);
    work.all += kDepthGridCost;
    for (const Light& light : sky) work.all += view_cost(light.view);
  }

  // The finest view first: what is computed for it serves the others.
  {
    const TraceStage stage(monitor.trace, "lattice");
    source->prepare(view);
  }
  // A stage of no length, which puts the report into the trace.
  if (const std::string report = to_text(source->lookups()); !report.empty()) {
    const TraceStage stage(monitor.trace, report);
  }
  if (is_first) {
    work.did(kDepthGridCost);
    light_sky(work);
  }
  if (have_moved) {
    const TraceStage stage(monitor.trace, "lamps");
    kept_lamps.clear();  // a stop may come before all are there
    for (Light& lamp : placed) {
      if (&lamp == &placed.front()) {
        lamp.depths = speckless_depths(*source, lamp.view);
      } else {
        take_depths(lamp);
      }
      work.did(view_cost(lamp.view));
    }
  } else {
    for (std::size_t i = 0; i < placed.size(); ++i)
      placed[i].depths = std::move(kept_lamps[i].depths);
  }
  kept_lamps = std::move(placed);
  const std::vector<Light>& lamps = kept_lamps;
  if (has_material()) {
    range = options.range ? *options.range : range_over(shown(view, kShownRays), options.material);
  }
  const Shading shading(device, scene(), ground_light, lamps, sky, bounces(lamps));
  exposure = options.exposure ? *options.exposure : metered(view, shading);

  LayeredImage picture{.image = {options.width, options.height, {}}, .layers = {}};
  Image& image = picture.image;
  image.loose = source->loose_pieces();
  image.loose.volume /= std::pow(to_scene.scale, 3);
  image.pixels.reserve(3 * index(0, image.height, image.width));
  const std::vector<View> views = views_of(camera, moving);
  work.all += static_cast<double>(views.size()) * view_cost(views.front()) - view_cost(view);
  draw(views, lamps, shading, with_layers, work, picture);
  return picture;
}

}  // namespace qjulia
