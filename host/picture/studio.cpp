#include "picture/studio.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>
#include <variant>

#include "base/range_check.hpp"
#include "base/setting_json.hpp"
#include "lattice/grid.hpp"
#include "map/checks.hpp"
#include "map/portals.hpp"
#include "mesh/mesh_report.hpp"
#include "picture/framing.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/picture/picture_settings.hpp"

namespace qjulia {

using namespace picture;
namespace {

using Eigen::Vector3d;

/// A draft has the coarsest grids. It has no lattice of images, which takes longer than the rays of
/// a small picture, and looks less finely for what loose pieces hang on.
constexpr int kDraftFinestCells = 128;
/// Rays that sample a material are at least so many in each picture; and the greatest number of
/// pictures that are sampled.
constexpr double kLeastShownRays = 2000;
constexpr std::size_t kMostShown = 12;
constexpr double kEverywhere = 1e6;  ///< map units: farther than any set reaches

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

double fineness_of(const PictureOptions& options) {
  const double share = std::max(options.width / kFullWidth, options.height / kFullHeight);
  return std::clamp(share, kLeastFineness, 1.0);
}

void expect_color(const char* field, const Rgb& color) {
  if ((color.array() >= 0).all() && (color.array() <= 1).all()) return;
  throw OptionError(field, "a colour's parts are 0 to 1");
}

/// @throws InputError
std::optional<Surrounded> surrounded(const Lighting& light, const std::stop_token& stop) {
  if (light.environment.empty()) return std::nullopt;
  return Surrounded{light_of(read_environment(light.environment, stop)), light.environment_turn};
}

/// Gives one place of a setting the value of another.
void copy_value(const ValuePlace& from, const ValuePlace& to) {
  std::visit(
      [&]<class Place>(const Place& source) {
        const Place& target = std::get<Place>(to);
        if constexpr (std::is_same_v<Place, WordPlace>) {
          target.set(source.index());
        } else if constexpr (std::is_same_v<Place, SizePlace>) {
          *target.width = *source.width;
          *target.height = *source.height;
        } else {
          *target = *source;
        }
      },
      from);
}

}  // namespace

void PictureOptions::validate() const {
  for (const int side : {width, height}) base::expect_between("size", side, 1, 16384, "pixels");
  expect_in_ranges(picture_settings(), *this);
  if (bits != 8 && bits != 16) throw OptionError("bits", fmt::format("{}; give 8 or 16", bits));
  map::expect_box(box);
  light.validate();
  if (background.kind == Backdrop::environment && light.environment.empty()) {
    throw OptionError("background", "there is no environment; give `environment`, too");
  }
  expect_color("background", background.color);
  expect_color("palette", palette.clay);
  for (const Rgb& stop : palette.stops) expect_color("palette", stop);
  if (palette.stops.size() < 2 || palette.stops.size() > Palette::kMostStops) {
    throw OptionError("palette", fmt::format("{} colours to go through; give 2 to {}",
                                             palette.stops.size(), Palette::kMostStops));
  }
  if (range) range->validate();
  if (camera.field_of_view > 0 && camera.field_of_view < 1) {
    throw OptionError(
        "field_of_view",
        fmt::format("{}; give 1 to 120 degrees, or 0 for parallel rays", camera.field_of_view));
  }
  map::expect_box(camera.frame, "frame");
  for (const Cut& cut : cuts) cut.validate();
}

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
                                     .environment = surrounded(options.light, stop),
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
  impl_->environment = surrounded(options.light, {});
}

Studio::~Studio() = default;
Studio::Studio(Studio&&) noexcept = default;
Studio& Studio::operator=(Studio&&) noexcept = default;

void Studio::resize(int width, int height) {
  impl_->options.width = width;
  impl_->options.height = height;
}

void Studio::Impl::turn(const Camera& camera) {
  PictureOptions turned = options;
  turned.camera = standing(camera);
  turned.validate();
  options.camera = turned.camera;
}

Camera Studio::Impl::standing(Camera camera) const {
  camera.up = camera.up.value_or(known_up);
  return camera;
}

View Studio::Impl::view_of(const Camera& camera) const {
  return camera_view(in_scene(camera, to_scene), framed, options.width, options.height,
                     options.samples);
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

void Studio::set_light(const PictureOptions& options) {
  options.validate();
  PictureOptions& own = impl_->options;
  const bool is_elsewhere = options.light.environment != own.light.environment;
  std::optional<Surrounded> environment;
  if (is_elsewhere) environment = surrounded(options.light, impl_->stop);
  PictureOptions wanted = options;  // places are those of options that may change
  for (const PictureSetting& setting : picture_settings()) {
    if (setting.remade == Remade::set) continue;
    const ValuePlace from = setting.place(wanted), to = setting.place(own);
    const bool has_changed = base::value_json(setting, from) != base::value_json(setting, to);
    if (setting.remade == Remade::sky && has_changed) impl_->up.reset();
    copy_value(from, to);
  }
  if (is_elsewhere) {
    impl_->environment = std::move(environment);
  } else if (impl_->environment) {
    impl_->environment->turn = own.light.environment_turn;
  }
}

void Studio::set_ground(double height) {
  constexpr double kFarthest = 1e9;
  base::expect_between("ground", height, -kFarthest, kFarthest);
  impl_->own_ground = height;
  impl_->up.reset();  // the sky lights the ground, too
}

Image Studio::picture(const Camera& camera, const ProgressMonitor& monitor) {
  impl_->turn(camera);
  return impl_->picture(monitor, /*with_layers=*/false, {}).image;
}

Image Studio::picture(const Camera& camera, std::span<const Camera> moving,
                      const ProgressMonitor& monitor) {
  for (const Camera& at : moving) {
    if (!at.look_at || !at.distance)
      throw OptionError("distance", "a camera that moves needs a distance and a point to look at");
    impl_->turn(at);
  }
  impl_->turn(camera);
  return impl_->picture(monitor, /*with_layers=*/false, moving).image;
}

LayeredImage Studio::layered_picture(const Camera& camera, const ProgressMonitor& monitor) {
  impl_->turn(camera);
  return impl_->picture(monitor, /*with_layers=*/true, {});
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
