#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

#include "base/range_check.hpp"
#include "layout/picture_layout.h"
#include "map/checks.hpp"
#include "map/portals.hpp"
#include "picture/depth_grid.hpp"
#include "picture/framing.hpp"
#include "picture/lens.hpp"
#include "picture/material_traits.hpp"
#include "picture/near_shadow.hpp"
#include "picture/shading.hpp"
#include "picture/specks.hpp"
#include "qjulia/error.hpp"
#include "qjulia/field.hpp"
#include "qjulia/picture.hpp"
#include "qjulia/picture_settings.hpp"
#include "qjulia/progress.hpp"
#include "shape/mesh_report.hpp"
#include "surface/grid.hpp"

namespace qjulia {

using namespace picture;
namespace {

using Eigen::Vector3d;

constexpr int kHalo = 2;               ///< rows of samples that normals look beyond a strip
constexpr int kStripSamples = 400000;  ///< keeps memory small and launches short
constexpr int kFloorMap = 256;         ///< texels a side at full fineness
/// A picture as large as this has light maps and grids at full fineness; a smaller one has coarser
/// ones, down to kLeastFineness.
constexpr double kFullWidth = 1280, kFullHeight = 960, kLeastFineness = 0.2;
/// A draft has the coarsest grids, fewer sky lights, and coarser lamps. It has no lattice of
/// images, which takes longer than the rays of a small picture, and looks less finely for what
/// loose pieces hang on.
constexpr int kSkyLights = 64, kDraftSkyLights = 16, kDraftFinestCells = 128;
constexpr double kDraftLamps = 0.5;
/// What a sample of the picture, a texel of a light, and the band's grids cost, in marched rays.
constexpr double kSampleCost = 0.4, kCoarseCost = 0.05, kDepthGridCost = 3e5;
/// Rays that sample the values of a material: in all pictures together, and at least in each; and
/// the greatest number of pictures that are sampled.
constexpr double kShownRays = 12000, kLeastShownRays = 2000;
constexpr std::size_t kMostShown = 12;
/// Views through a lens for each sample of a pixel.
constexpr int kLensViews = 16;
/// What radiance is multiplied by at an exposure of 0.
constexpr double kBaseExposure = 0.62;
constexpr double kEverywhere = 1e6;  ///< map units: farther than any set reaches

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

/// What the strip's pixels show, added to `layers`.
void add_layers(const View& view, const Strip& strip, const std::vector<float>& normals,
                const ShapeToMap& to_scene, PictureLayers& layers) {
  const int columns = view.columns / strip.samples;
  for (int row = 0; row < strip.rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const int i = column * strip.samples + strip.samples / 2;
      const int j = row * strip.samples + strip.samples / 2;
      const std::size_t sample = index(i, j + strip.halo, view.columns);
      const float depth = strip.depths[sample];
      if (depth < 0) {
        layers.depth.push_back(std::numeric_limits<float>::infinity());
        layers.normal.insert(layers.normal.end(), 3, 0.0F);
        layers.position.insert(layers.position.end(), 3, std::numeric_limits<float>::quiet_NaN());
        continue;
      }
      const double x = i + 0.5, y = strip.first_row * strip.samples + j + 0.5;
      const Vector3d point = to_scene.to_shape(view.at(x, y, double{depth}));
      layers.depth.push_back(depth / static_cast<float>(to_scene.scale));
      const auto normal = normals.begin() + static_cast<std::ptrdiff_t>(3 * sample);
      layers.normal.insert(layers.normal.end(), normal, normal + 3);
      for (const double c : point) layers.position.push_back(static_cast<float>(c));
    }
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

/// The camera in the scene's coordinates, with what it looks at, what it frames and its distance.
Camera in_scene(Camera camera, const ShapeToMap& to_scene) {
  if (camera.distance) *camera.distance *= to_scene.scale;
  if (camera.look_at) camera.look_at = to_scene.to_map(*camera.look_at);
  if (camera.frame) camera.frame = to_scene.to_map(*camera.frame);
  return camera;
}

/// What a map's pictures show: the part asked for (shape units), else the box of the shape and its
/// copies, or where none is known, the source's bounds.
Box framed_box(const Map& map, const std::optional<Box>& part, const DepthSource& source) {
  const std::optional<Box> box = part ? part : map::box_with_copies(map);
  return box ? map.frame.shape_to_map.to_map(*box) : source.bounds();
}

/// The part of space that the options leave of the map's set, map coordinates. @throws OptionError
std::optional<Box> part_left(const Map& map, const PictureOptions& options) {
  if (!options.box && options.cuts.empty()) return std::nullopt;
  Box part = options.box.value_or(surface::cube(kEverywhere / map.frame.shape_to_map.scale));
  for (const Cut& cut : options.cuts) {
    const auto axis = static_cast<Eigen::Index>(cut.axis - 'x');
    const double at = place_of(cut, options.box ? options.box : map.frame.box);
    part.high[axis] = std::min(part.high[axis], at);
  }
  if (!(part.size().array() > 0).all()) throw OptionError("cut", "nothing is left of the box");
  return map.frame.shape_to_map.to_map(part);
}

double cost(const View& view) {
  const double of_ray = view.coarse_will_do ? kCoarseCost : view.samples > 1 ? kSampleCost : 1;
  return double(view.columns) * view.rows * of_ray;
}

double fineness_of(const PictureOptions& options) {
  const double share = std::max(options.width / kFullWidth, options.height / kFullHeight);
  return std::clamp(share, kLeastFineness, 1.0);
}

void expect_color(const char* field, const Rgb& color) {
  if ((color.array() >= 0).all() && (color.array() <= 1).all()) return;
  throw OptionError(field, "a colour's parts are 0 to 1");
}

}  // namespace

void PictureOptions::validate() const {
  for (const int side : {width, height}) base::expect_between("size", side, 1, 16384, "pixels");
  expect_in_ranges(picture_settings(), *this);
  base::expect_finite("azimuth", camera.azimuth);
  map::expect_box(box);
  light.validate();
  expect_color("background", background.color);
  expect_color("palette", palette.clay);
  for (const Rgb& stop : palette.stops) expect_color("palette", stop);
  if (palette.stops.size() < 2 || palette.stops.size() > Palette::kMostStops) {
    throw OptionError("palette", fmt::format("{} colours to go through; give 2 to {}",
                                             palette.stops.size(), Palette::kMostStops));
  }
  if (range) range->validate();
  map::expect_box(camera.frame, "frame");
  if (camera.look_at) {
    for (const double c : *camera.look_at) base::expect_finite("look_at", c);
  }
  if (camera.focus) {
    for (const double c : *camera.focus) base::expect_finite("focus", c);
  }
  if (camera.distance) base::expect_finite("distance", *camera.distance);
  for (const Cut& cut : cuts) {
    base::expect_finite("cut", cut.at);
    if (cut.axis < 'x' || cut.axis > 'z') {
      throw OptionError("cut", fmt::format("'{}' is not an axis; give x, y or z", cut.axis));
    }
  }
}

namespace {

/// How far a picture is, in the unit of `cost`.
struct Work {
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

}  // namespace

struct Studio::Impl {
  static std::unique_ptr<Impl> of_map(const Device& device, const Map& map,
                                      const PictureOptions& options, bool is_draft,
                                      const std::stop_token& stop);

  Device device;
  PictureOptions options;
  std::unique_ptr<DepthSource> source;
  Box framed;           ///< in the scene
  ShapeToMap to_scene;  ///< from the shape's coordinates to those of source and frame
  double fineness = 1;
  bool is_draft = false;
  UpAxis known_up = kDefaultUp;  ///< where the camera does not say
  std::stop_token stop{};        ///< ends pictures that have no other
  Coloring coloring{};
  MaterialRange range{};  ///< the last picture's
  double exposure = 0;    ///< the last picture's, stops
  Rig rig{};
  std::optional<Box> part{};        ///< what cuts leave, in the scene
  std::vector<Vector3d> outline{};  ///< shape units, once it was asked for
  std::optional<UpAxis> up{};       ///< for which sky and ground were made
  std::vector<Light> sky{};
  double ground = 0;  ///< height along up
  GroundLight ground_light{};

  void turn(const Camera& camera);
  /// The camera with what is up.
  Camera standing(Camera camera) const;
  const std::vector<Vector3d>& known_outline();
  std::vector<Camera> aimed(std::span<const Camera> cameras, std::span<const Vector3d> others);
  /// @param camera with a place of its own.
  View view_of(const Camera& camera) const {
    return camera_view(in_scene(camera, to_scene), framed, options.width, options.height,
                       options.samples);
  }
  bool has_material() const { return options.material != Material::clay; }
  /// About so many of a view's rays, and their depths.
  struct Sampled {
    View few;
    std::vector<float> depths;
  };
  /// The look-up tables for the view's own rays are made first, and serve these rays, too, so that
  /// the picture is the same, bit for bit, where what these rays tell is given.
  Sampled sampled(const View& view, double rays);
  /// Values of the material at about so many points of a view that was prepared.
  std::vector<float> shown(const View& view, double rays);
  LayeredImage picture(const ProgressMonitor& monitor, bool with_layers);
  /// Depths of the sky's lights, and what they light of the ground.
  void light_sky(Work& work);
  /// The mean of the views, strip by strip; layers are those of the first.
  void draw(std::span<const View> views, std::span<const Light> lamps, const Shading& shading,
            bool with_layers, Work& work, LayeredImage& picture) const;
  /// What of a strip a view shows.
  Strip seen_strip(const View& view, SpecklessDepths& depths, std::span<const Light> lamps, int row,
                   int rows) const;
  /// The views whose mean the picture is.
  std::vector<View> views_of(const Camera& camera);
  /// The distance, along the axis, of what is seen nearest to the middle of a view.
  double distance_in_focus(const View& view);
  /// The exposure, in stops, with which what this view shows gets as much light as in the studio.
  double metered(const View& view, const Shading& shading);

 private:
  Scene scene() const {
    return {direction(*options.camera.up),
            ground,
            framed.center(),
            0.5 * framed.diagonal(),
            options.ground,
            options.background,
            options.palette,
            options.matter,
            rig,
            options.tone};
  }
  /// The box whose faces, where they cut the set, have colours of their own; empty for heights and
  /// factors, which continue inside the set.
  std::optional<Box> faces() const {
    const bool goes_on =
        options.material == Material::height || options.material == Material::factor;
    return goes_on ? std::nullopt : part;
  }
  /// What colours the strip's samples: a position in the palette, or, if below 0, minus the
  /// lightness of clay. Empty where all is plain clay.
  std::vector<float> traits_of(const View& view, const Strip& strip) const;
  void take_depths(Light& light) const {
    light.depths = source->depths(light.view, 0, light.view.rows);
  }
};

std::unique_ptr<Studio::Impl> Studio::Impl::of_map(const Device& device, const Map& map,
                                                   const PictureOptions& options, bool is_draft,
                                                   const std::stop_token& stop) {
  options.validate();
  map.validate();
  const double fineness = is_draft ? kLeastFineness : fineness_of(options);
  MarchedSet set{.map = map,
                 .iterations = options.iterations,
                 .escape = options.escape,
                 .part = part_left(map, options),
                 .precision = options.precision,
                 .material = options.material,
                 .stop = stop,
                 .interpolates_images = !is_draft && !options.exact,
                 .rays = is_draft ? 0.0
                                  : static_cast<double>(options.width) * options.height *
                                        options.samples * options.samples,
                 .keeps_loose = options.keep_loose};
  if (options.box) set.framed = map.frame.shape_to_map.to_map(*options.box);
  set.cells = static_cast<int>(set.cells * std::sqrt(fineness));
  if (is_draft) set.finest_cells = kDraftFinestCells;
  auto source = march_source(device, set);
  const Box framed = framed_box(map, options.box, *source);
  const UpAxis up = map.frame.up.value_or(kDefaultUp);
  const Coloring coloring{options.material, direction(options.camera.up.value_or(up)),
                          map.frame.shape_to_map};
  return std::make_unique<Impl>(Impl{.device = device,
                                     .options = options,
                                     .source = std::move(source),
                                     .framed = framed,
                                     .to_scene = map.frame.shape_to_map,
                                     .fineness = fineness,
                                     .is_draft = is_draft,
                                     .known_up = up,
                                     .stop = stop,
                                     .coloring = coloring,
                                     .range = options.range.value_or(MaterialRange{}),
                                     .part = std::move(set.part)});
}

Studio::Studio(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

std::string to_text(const LookupReport& report) {
  std::string text;
  if (report.nodes > 0) {
    const std::string first = report.iterates > 1
                                  ? fmt::format("the first {} iterates", report.iterates)
                                  : "first iterates";
    text = fmt::format("{} from {} nodes, {:.0f} % of their cells trusted", first, report.nodes,
                       100 * report.trusted_share);
  }
  if (report.table_bytes > 0) {
    text += fmt::format("{}later ones from a table of {:.1f} MB", text.empty() ? "" : "; ",
                        1e-6 * static_cast<double>(report.table_bytes));
  }
  return text;
}

LookupReport Studio::lookups() const { return impl_->source->lookups(); }

MaterialRange Studio::range() const { return impl_->range; }

Studio::Studio(const Device& device, const Map& map, const PictureOptions& options,
               const std::stop_token& stop)
    : Studio(Impl::of_map(device, map, options, /*is_draft=*/false, stop)) {}

Studio Studio::of_drafts(const Device& device, const Map& map, const PictureOptions& options,
                         const std::stop_token& stop) {
  return Studio(Impl::of_map(device, map, options, /*is_draft=*/true, stop));
}

Studio::Studio(const Device& device, const TriangleMesh& mesh, const Box& framed,
               const PictureOptions& options) {
  options.validate();
  mesh.validate();
  if (const std::string problem = shape::size_problem(mesh.box()); !problem.empty()) {
    throw InputError("the mesh cannot be drawn: " + problem);
  }
  const double side = framed.size().maxCoeff();
  if (!(side > 0) || !std::isfinite(side)) {
    throw InputError("the box to frame has no size; give the mesh's own box");
  }
  // The mesh is made as large as maps are, so that both are lit alike.
  const ShapeToMap to_scene{kMapSide / side, -kMapSide / side * framed.center()};
  impl_ = std::make_unique<Impl>(Impl{device, options, mesh_source(mesh, to_scene, framed),
                                      to_scene.to_map(framed), to_scene, fineness_of(options),
                                      /*is_draft=*/false, guess_up(mesh)});
  impl_->options.material = Material::clay;
}

Studio::~Studio() = default;
Studio::Studio(Studio&&) noexcept = default;
Studio& Studio::operator=(Studio&&) noexcept = default;

void Studio::resize(int width, int height) {
  impl_->options.width = width;
  impl_->options.height = height;
}

void Studio::Impl::turn(const Camera& camera) {
  options.camera = standing(camera);
  options.validate();
}

Camera Studio::Impl::standing(Camera camera) const {
  camera.up = camera.up.value_or(known_up);
  return camera;
}

const std::vector<Vector3d>& Studio::Impl::known_outline() {
  if (!outline.empty()) return outline;
  for (const Vector3d& point : source->outline()) outline.push_back(to_scene.to_shape(point));
  Eigen::AlignedBox3d around;
  for (const Vector3d& point : outline) around.extend(point);
  if (outline.empty() || around.sizes().isZero(0)) {
    // Only the box is known: a point alone would be looked at from within it.
    outline.clear();
    const Eigen::AlignedBox3d box(to_scene.to_shape(framed.low), to_scene.to_shape(framed.high));
    for (int corner = 0; corner < 8; ++corner) {
      outline.emplace_back(box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)));
    }
  }
  return outline;
}

std::vector<Camera> Studio::Impl::aimed(std::span<const Camera> cameras,
                                        std::span<const Vector3d> others) {
  std::vector<Camera> all;
  for (const Camera& camera : cameras) all.push_back(standing(camera));
  const bool are_placed = std::ranges::all_of(
      all, [](const Camera& camera) { return camera.look_at && camera.distance; });
  if (are_placed) return all;
  std::vector<Vector3d> points = known_outline();
  points.insert(points.end(), others.begin(), others.end());
  return picture::aimed(all, points, static_cast<double>(options.width) / options.height);
}

namespace {

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

std::vector<Vector3d> Studio::outline() { return impl_->known_outline(); }

std::vector<Camera> Studio::aimed(std::span<const Camera> cameras,
                                  std::span<const Vector3d> others) {
  PictureOptions options = impl_->options;
  for (const Camera& camera : cameras) {
    options.camera = camera;
    options.validate();
  }
  for (const Vector3d& point : others) {
    if (!point.allFinite()) throw InputError("a point that is to be seen is not finite");
  }
  return impl_->aimed(cameras, others);
}

std::vector<float> Studio::shown(std::span<const Camera> cameras) {
  if (!impl_->has_material()) return {};
  const std::vector<Camera> placed = aimed(cameras);
  std::vector<float> all;
  // So many cameras, spaced evenly, stand for all.
  const std::size_t step = (placed.size() + kMostShown - 1) / kMostShown;
  const double count = std::ceil(static_cast<double>(placed.size()) / static_cast<double>(step));
  for (std::size_t i = 0; i < placed.size(); i += step) {
    const View view = impl_->view_of(placed[i]);
    impl_->source->prepare(view);
    const std::vector<float> seen =
        impl_->shown(view, std::max(kShownRays / count, kLeastShownRays));
    all.insert(all.end(), seen.begin(), seen.end());
  }
  return all;
}

double Studio::exposure() const { return impl_->exposure; }

void Studio::set_exposure(double stops) {
  PictureOptions options = impl_->options;
  options.exposure = stops;
  options.validate();
  impl_->options.exposure = stops;
}

void Studio::set_range(const std::optional<MaterialRange>& range) {
  if (range) range->validate();
  if (impl_->has_material()) impl_->options.range = range;
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

Image Studio::picture(const Camera& camera, const ProgressMonitor& monitor) {
  impl_->turn(camera);
  return impl_->picture(monitor, /*with_layers=*/false).image;
}

LayeredImage Studio::layered_picture(const Camera& camera, const ProgressMonitor& monitor) {
  impl_->turn(camera);
  return impl_->picture(monitor, /*with_layers=*/true);
}

void Studio::Impl::light_sky(Work& work) {
  const TraceStage stage(work.monitor.trace, "sky");
  for (Light& light : sky) {
    take_depths(light);
    work.did(cost(light.view));
  }
  ground = lowest(*source, direction(*options.camera.up), fineness);
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
    std::vector<float> pixels(QJ_PIXEL_SIZE * index(0, rows, image.width));
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
      const Shaded shaded = shading.shade(view, strip, with_layers && i == 0);
      std::ranges::transform(pixels, shaded.pixels, pixels.begin(),
                             [&](float sum, float value) { return sum + share * value; });
      if (i == 0) {
        image.covered += covered_pixels(view, strip);
        if (with_layers) add_layers(view, strip, shaded.normals, to_scene, picture.layers);
      }
      work.did(cost(view) * rows / image.height);
    }
    const Developed shown = shading.develop(pixels, row, image.width, image.height,
                                            kBaseExposure * std::exp2(exposure));
    image.pixels.insert(image.pixels.end(), shown.pixels.begin(), shown.pixels.end());
    if (options.background.kind == Backdrop::transparent) {
      image.alpha.insert(image.alpha.end(), shown.alpha.begin(), shown.alpha.end());
    }
  }
}

std::vector<View> Studio::Impl::views_of(const Camera& camera) {
  const int samples = options.samples;
  const View view = view_of(camera);
  if (camera.aperture == 0) return {view};
  const View pixels = view.coarse();
  const double focus = camera.focus ? distance_along_axis(pixels, to_scene.to_map(*camera.focus))
                                    : distance_in_focus(pixels);
  if (!(focus > 0)) throw OptionError("focus", "it lies behind the camera");
  return lens_views(pixels, camera.aperture, focus, kLensViews * samples * samples);
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

LayeredImage Studio::Impl::picture(const ProgressMonitor& monitor, bool with_layers) {
  source->stop_with(monitor.stop.stop_possible() ? monitor.stop : stop);
  options.camera = aimed(std::span(&options.camera, 1), {}).front();
  const Camera& camera = options.camera;
  const View view = view_of(camera);
  rig = options.light.whole();
  std::vector<Light> lamps =
      lamp_lights(rig, camera, source->bounds(), fineness * (is_draft ? kDraftLamps : 1));
  double cost_of_lamps = 0;
  for (const Light& lamp : lamps) cost_of_lamps += cost(lamp.view);
  const bool is_first = up != camera.up;
  Work work{monitor, cost(view) + cost_of_lamps};
  if (is_first) {
    up.reset();  // a stop may come before all is there
    sky = sky_lights(rig, *camera.up, source->bounds(), fineness,
                     is_draft ? kDraftSkyLights : kSkyLights);
    work.all += kDepthGridCost;
    for (const Light& light : sky) work.all += cost(light.view);
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
  {
    const TraceStage stage(monitor.trace, "lamps");
    for (Light& lamp : lamps) {
      if (&lamp == &lamps.front()) {
        lamp.depths = speckless_depths(*source, lamp.view);
      } else {
        take_depths(lamp);
      }
      work.did(cost(lamp.view));
    }
  }
  if (has_material()) {
    range = options.range ? *options.range : range_over(shown(view, kShownRays), options.material);
  }
  const Shading shading(device, scene(), ground_light, lamps, sky);
  exposure = options.exposure ? *options.exposure : metered(view, shading);

  LayeredImage picture{.image = {options.width, options.height, {}}, .layers = {}};
  Image& image = picture.image;
  image.loose = source->loose_pieces();
  image.loose.volume /= std::pow(to_scene.scale, 3);
  image.pixels.reserve(3 * index(0, image.height, image.width));
  const std::vector<View> views = views_of(camera);
  work.all += static_cast<double>(views.size()) * cost(views.front()) - cost(view);
  draw(views, lamps, shading, with_layers, work, picture);
  return picture;
}

Image render(const Device& device, const Map& map, const PictureOptions& options,
             const ProgressMonitor& monitor) {
  return Studio(device, map, options, monitor.stop).picture(options.camera, monitor);
}

LayeredImage layered_render(const Device& device, const Map& map, const PictureOptions& options,
                            const ProgressMonitor& monitor) {
  return Studio(device, map, options, monitor.stop).layered_picture(options.camera, monitor);
}

Image render_mesh(const Device& device, const TriangleMesh& mesh, const Box& framed,
                  const PictureOptions& options, const ProgressMonitor& monitor) {
  return Studio(device, mesh, framed, options).picture(options.camera, monitor);
}

}  // namespace qjulia
