#include "jobs/picture_series.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>

#include "describe/files.hpp"
#include "describe/provenance.hpp"
#include "jobs/picture_sweep.hpp"
#include "qjulia/map/knob_table.hpp"
#include "qjulia/map/map_file.hpp"
#include "qjulia/picture/picture_settings.hpp"
#include "qjulia/surface/surface.hpp"

namespace qjulia::tools {
namespace {

bool has_range(const PictureOptions& options) { return options.material != Material::clay; }

/// What a studio makes again where this member of a view changes.
Remade remade_for(const std::string& name) {
  const auto found = std::ranges::find(picture_settings(), name, &PictureSetting::name);
  return found == picture_settings().end() ? Remade::set : found->remade;
}

/// All of a view but where the camera is.
nlohmann::json without_camera(const View& view) {
  nlohmann::json all = to_json(view.map_options);
  all.update(to_json(view.picture));
  all.update(to_json(view.scatter));
  all["map"] = view.map;
  for (const PictureSetting& setting : picture_settings()) {
    if (setting.is_of_camera) all.erase(setting.name);
  }
  return all;
}

/// What of a view the set depends on.
nlohmann::json of_set(const View& view) {
  nlohmann::json all = without_camera(view);
  for (const PictureSetting& setting : picture_settings()) {
    if (setting.remade != Remade::set) all.erase(setting.name);
  }
  all.erase("scatter_time");
  return all;
}

std::vector<Camera> cameras_of(const std::vector<View>& views) {
  std::vector<Camera> cameras;
  cameras.reserve(views.size());
  for (const View& view : views) cameras.push_back(view.picture.camera);
  return cameras;
}

}  // namespace

Scene read_scene(const std::string& input, Session& session) {
  // Not `return {{}, read_mesh(…)}`: where that throws, GCC 12 destroys the map twice.
  Scene scene;
  if (is_mesh_file(input)) {
    scene.mesh = session.read_mesh(input);
  } else {
    scene.map = session.read_map(input);
  }
  return scene;
}

Scene turned(const Device& device, Scene scene, const std::string& input, const View& view,
             Session& session) {
  if (!scene.map) return scene;
  scene.map = with_knobs(device, *scene.map, view.map_options, input);
  warn_if_unbounded(*scene.map, view.picture.iterations, input, session.console);
  return scene;
}

Scene Scatterer::at(const Device& device, Scene scene, const View& view, Session& session) {
  const Map& map = scene.map.value();
  nlohmann::json wanted = of_set(view);
  if (of_ != wanted) {
    const SurfaceOptions options{.resolution = view.scatter.resolution,
                                 .iterations = view.picture.iterations,
                                 .box = view.picture.box,
                                 .precision = view.picture.precision,
                                 .escape = view.picture.escape};
    const TriangleMesh mesh = extract_surface(device, map, options, session.monitor());
    if (mesh.triangles.empty()) {
      throw InputError(
          "the set has no surface of which parts could fly; give a smaller detail, or a higher "
          "scatter-resolution");
    }
    about_.up = view.picture.camera.up.value_or(map.frame.up.value_or(kDefaultUp));
    about_.framed = map.frame.box.value_or(mesh.box());
    const Eigen::Vector3d up = direction(about_.up);
    about_.ground =
        std::ranges::min(mesh.vertices, {}, [&](const auto& x) { return x.dot(up); }).dot(up);
    moving_ = scattered(mesh, view.scatter.chosen(), about_.up);
    of_ = std::move(wanted);
  }
  scene.mesh = mesh_after(moving_, view.scatter.time);
  scene.scattered = about_;
  return scene;
}

Studio studio_of(const Device& device, const Scene& scene, const PictureOptions& options,
                 Session& session) {
  const TraceStage stage(session.trace(), "studio");
  if (scene.scattered) {
    PictureOptions standing = options;
    standing.camera.up = scene.scattered->up;
    Studio studio(device, scene.mesh, scene.scattered->framed, standing);
    studio.set_ground(scene.scattered->ground);
    return studio;
  }
  if (!scene.map) return {device, scene.mesh, scene.mesh.box(), options};
  return {device, *scene.map, options, session.stop()};
}

PictureOptions as_drawn(PictureOptions options, Studio& studio) {
  const std::optional<UpAxis> up = options.camera.up;
  options.camera = studio.aimed(std::span(&options.camera, 1)).front();
  options.camera.up = up;
  options.exposure = studio.exposure();
  if (has_range(options)) options.range = studio.range();
  return options;
}

std::string carried_map(const Scene& scene, const MapOptions& options, const Job& job) {
  if (!scene.map) return {};
  const nlohmann::json usual = to_json(MapOptions{}), how = to_json(options);
  Map map = *scene.map;
  if (how != usual) add_job(map, job);
  return packed_map(map);
}

ProgressMonitor part_monitor(Session& session, std::size_t done, std::size_t all) {
  ProgressMonitor monitor = session.monitor();
  monitor.on_progress = [&session, show = monitor.on_progress, done, all](Progress progress) {
    if (!show) return;
    progress.fraction = (static_cast<double>(done) + progress.fraction) / static_cast<double>(all);
    progress.seconds_left =
        session.seconds() * (1 - progress.fraction) / std::max(progress.fraction, 1e-6);
    show(progress);
  };
  return monitor;
}

PictureSeries::PictureSeries(const Device& device, Scene scene, std::string input,
                             std::vector<View> views, Job job, Session& session)
    : device_(device),
      scene_(std::move(scene)),
      input_(std::move(input)),
      views_(std::move(views)),
      job_(std::move(job)),
      session_(session) {}

bool PictureSeries::shows_one_set() const {
  const nlohmann::json first = of_set(views_.front());
  return std::ranges::all_of(views_, [&](const View& view) { return of_set(view) == first; });
}

Kept PictureSeries::kept_for(const nlohmann::json& wanted,
                             std::vector<std::string>& changed) const {
  if (!studio_) return Kept::nothing;
  Kept kept = is_lit_ ? Kept::all : Kept::set;
  for (const auto& [name, value] : wanted.items()) {
    if (of_studio_.at(name) == value) continue;
    changed.push_back(name);
    const Remade remade = remade_for(name);
    const Kept serves = remade == Remade::set   ? Kept::nothing
                        : remade == Remade::sky ? Kept::set
                                                : Kept::all;
    kept = std::min(kept, serves);
  }
  return kept;
}

Scene PictureSeries::turned_scene(const View& view) {
  if (view.map.empty()) return turned(device_, scene_, input_, view, session_);
  return turned(device_, read_scene(view.map, session_), view.map, view, session_);
}

Studio& PictureSeries::studio(const View& view) {
  nlohmann::json wanted = without_camera(view);
  std::vector<std::string> changed;
  if (kept_for(wanted, changed) == Kept::nothing) {
    studio_.reset();
    is_lit_ = false;
    shown_ = turned_scene(view);
    if (view.scatter.field) {
      shown_ = scatterer_.at(device_, std::move(shown_), view, session_);
    }
    studio_ = studio_of(device_, shown_, view.picture, session_);
  } else if (!changed.empty()) {
    studio_->set_light(view.picture);
  }
  of_studio_ = std::move(wanted);
  return *studio_;
}

SeriesFrame PictureSeries::frame_of_camera() {
  const PictureOptions& options = views_.front().picture;
  Studio& seen = studio(views_.front());
  SeriesFrame frame{seen.aimed(cameras_of(views_)), options.range, {}};
  if (has_range(options) && !options.range) {
    frame.range = range_over(seen.shown(frame.cameras), options.material);
  }
  return frame;
}

SeriesFrame PictureSeries::frame_of_maps() {
  constexpr std::size_t kMostDrafts = 48;
  const TraceStage stage(session_.trace(), "series");
  const PictureOptions& first = views_.front().picture;
  SeriesFrame frame{cameras_of(views_), first.range, {}};
  const bool is_placed = std::ranges::all_of(
      frame.cameras, [](const Camera& camera) { return camera.look_at && camera.distance; });
  const bool needs_range = has_range(first) && !first.range;
  if (is_placed && !needs_range) return frame;
  const std::size_t drafts = std::min(kMostDrafts, views_.size());
  std::vector<Eigen::Vector3d> seen;
  std::vector<float> values;
  std::optional<Studio> studio;
  for (std::size_t i = 0; i < drafts; ++i) {
    const double done = static_cast<double>(i) / static_cast<double>(drafts);
    session_.monitor().report({"looking at the series", done, -1, {}});
    const std::size_t number = drafts == 1 ? 0 : i * (views_.size() - 1) / (drafts - 1);
    const View& view = views_[number];
    const Scene scene = turned_scene(view);
    studio = Studio::of_drafts(device_, *scene.map, view.picture, session_.stop());
    if (!is_placed) {
      const std::vector<Eigen::Vector3d> outline = studio->outline();
      seen.insert(seen.end(), outline.begin(), outline.end());
    }
    if (!needs_range) continue;
    const std::vector<float> some = studio->shown(std::span(&view.picture.camera, 1));
    values.insert(values.end(), some.begin(), some.end());
  }
  frame.cameras = studio->aimed(frame.cameras, seen);
  if (needs_range) frame.range = range_over(std::move(values), first.material);
  return frame;
}

SeriesFrame PictureSeries::frame() {
  if (!frame_) frame_ = !scene_.map || shows_one_set() ? frame_of_camera() : frame_of_maps();
  return *frame_;
}

SeriesFrame PictureSeries::frame_with_exposure() {
  frame();
  constexpr int kReduction = 4;
  // The first picture may show nothing.
  for (const std::size_t number : {std::size_t{0}, views_.size() / 2, views_.size() - 1}) {
    const PictureOptions& options = views_[number].picture;
    if (frame_->exposure || options.exposure) break;
    Studio& metered = studio(views_[number]);
    metered.resize(std::max(1, options.width / kReduction),
                   std::max(1, options.height / kReduction));
    const Image image = metered.picture(frame_->cameras[number], session_.monitor());
    metered.resize(options.width, options.height);
    if (image.covered > 0) frame_->exposure = metered.exposure();
    studio_.reset();  // its light is that of a small picture
  }
  // Where none of them shows anything, the exposure must not depend on which picture is drawn
  // first.
  if (!frame_->exposure) frame_->exposure = 0;
  return *frame_;
}

PictureSeries::Picture PictureSeries::picture(std::size_t number, const View& base,
                                              bool carries_map, const ProgressMonitor& monitor) {
  frame();
  View view = views_.at(number);
  std::vector<std::string> changed;
  const Kept kept = kept_for(without_camera(view), changed);
  Studio& drawn = studio(view);
  const std::optional<UpAxis> up = view.picture.camera.up;
  view.picture.camera = frame_->cameras[number];
  view.picture.camera.up = up;
  view.picture.range = frame_->range;
  drawn.set_range(frame_->range);
  is_lit_ = true;
  const bool has_own_exposure = view.picture.exposure.has_value();
  if (!has_own_exposure && frame_->exposure) drawn.set_exposure(*frame_->exposure);
  const std::vector<Camera> moving =
      moving_ ? moving_(number, view.picture.camera) : std::vector<Camera>{};
  Picture made{.image = drawn.picture(view.picture.camera, moving, monitor),
               .view = view,
               .map = {},
               .job = {},
               .kept = kept,
               .changed = std::move(changed)};
  if (!has_own_exposure && !frame_->exposure && made.image.covered > 0)
    frame_->exposure = drawn.exposure();
  made.view.picture = as_drawn(view.picture, drawn);
  made.job = frame_job(job_, base, made.view);
  if (!view.map.empty()) {
    made.job.options["map"] = name_of(view.map);
    made.job.inputs["map"] = Job::Input{.path = view.map, .hash = {}};
    made.job.hash_inputs();
  }
  if (carries_map) made.map = carried_map(shown_, view.map_options, made.job);
  return made;
}

}  // namespace qjulia::tools
