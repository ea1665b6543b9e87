/// qjulia render: a map (or a mesh, for comparison) in, a picture out.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <vector>

#include "base/text.hpp"
#include "commands.hpp"
#include "files.hpp"
#include "map_options.hpp"
#include "notes.hpp"
#include "picture_options.hpp"
#include "picture_sweep.hpp"
#include "provenance.hpp"
#include "qjulia/error.hpp"
#include "qjulia/file_types.hpp"
#include "qjulia/knob_table.hpp"
#include "qjulia/map_file.hpp"
#include "qjulia/picture.hpp"

namespace qjulia::tools {
namespace {

struct RenderArguments {
  std::string input;
  OutputName output;
  TrustedDevice device;
  SweepChoice sweep;
  std::string layers;  ///< prefix of their files; empty: none
  bool preview = false, no_map = false;
  MapOptions map_options;
  std::optional<std::string> palette;
  PictureOptions options;
  std::vector<Option> camera;
  std::optional<Option> material;
};

PictureOptions checked_options(const RenderArguments& arguments) {
  PictureOptions options = arguments.options;
  options.validate();
  arguments.map_options.knobs.validate();
  if (arguments.palette) options.palette = palette_of(*arguments.palette, options.material);
  auto given = arguments.map_options.given();
  if (!options.cuts.empty()) given.emplace_back("--cut");
  if (!given.empty()) expect_map(given.front(), arguments.input);
  if (is_mesh_file(arguments.input) && !arguments.material->given()) {
    options.material = Material::clay;  // a look's is for maps
  }
  if (options.material != Material::clay) expect_map("--material", arguments.input);
  if (options.range && options.material == Material::clay) {
    throw InputError("--range: clay has one colour; give --material iterations or another, too");
  }
  if (options.keep_loose) expect_map("--keep-loose", arguments.input);
  if (options.exact) expect_map("--exact", arguments.input);
  return options;
}

/// What to draw, read before a device is opened.
struct Scene {
  std::optional<Map> map;  ///< or else the mesh
  TriangleMesh mesh;
};

Scene read_scene(const RenderArguments& arguments, Session& session) {
  // Not `return {{}, read_mesh(…)}`: where that throws, GCC 12 destroys the map twice.
  Scene scene;
  if (is_mesh_file(arguments.input)) {
    scene.mesh = session.read_mesh(arguments.input);
  } else {
    scene.map = session.read_map(arguments.input);
  }
  return scene;
}

/// The scene with the map's knobs turned, as its picture shows it.
/// @param view what is turned, and how orbits are iterated then.
Scene turned(const Device& device, Scene scene, const std::string& input, const View& view,
             Session& session) {
  if (!scene.map) return scene;
  scene.map = with_knobs(device, *scene.map, view.map_options, input);
  warn_if_unbounded(*scene.map, view.picture.iterations, input, session.console);
  return scene;
}

Studio studio_of(const Device& device, const Scene& scene, const PictureOptions& options,
                 Session& session) {
  const TraceStage stage(session.trace(), "studio");
  if (!scene.map) return {device, scene.mesh, scene.mesh.box(), options};
  return {device, *scene.map, options, session.stop()};
}

/// The map that a picture of the scene holds.
/// @param options what was turned on the map, and `job` what turned it.
std::string carried_map(const Scene& scene, const RenderArguments& arguments,
                        const MapOptions& options, const Job& job) {
  if (!scene.map || arguments.no_map) return {};
  const nlohmann::json usual = to_json(MapOptions{}), how = to_json(options);
  const bool has_knobs = std::ranges::any_of(
      knob_table(), [&](const Knob& knob) { return how.at(knob.name) != usual.at(knob.name); });
  Map map = *scene.map;
  if (has_knobs) add_job(map, job);
  return packed_map(map);
}

/// Says so when a picture shows nothing. @throws Error where a part of the set was asked for.
void warn_if_empty(const Image& image, const std::string& input, const PictureOptions& options,
                   Session& session) {
  if (image.covered > 0) return;
  const bool is_aimed = options.camera.look_at || options.camera.frame || options.camera.zoom > 1;
  if ((options.box || !options.cuts.empty()) && !is_aimed) {
    throw Error(
        fmt::format("the set of '{}' is empty in this box; try another --box or --cut", input));
  }
  session.console.warn(
      fmt::format("the picture shows nothing of '{}'; try another --box, --slice, --detail or "
                  "camera",
                  input));
}

/// "bunny.png": "bunny.preview.png".
std::filesystem::path preview_path(const std::filesystem::path& picture) {
  return picture.parent_path() / (picture.stem().string() + ".preview.png");
}

constexpr const char* kPreviewNote = "preview";

/// A preview goes when its picture is done, and so must not take another file's name.
void check_preview(const std::filesystem::path& path, const std::stop_token& stop) {
  if (!std::filesystem::exists(path)) return;
  try {
    if (embedded_note(path, stop).at("made_with").contains(kPreviewNote)) return;
  } catch (const InputError&) {
    // It is no picture of ours.
  }
  throw InputError(fmt::format(
      "--preview: '{}' exists and is not a preview; move it, or give --output another name",
      path.string()));
}

/// A rough picture of the same view, soon. It goes when the picture is done, and stays when that
/// was interrupted.
void draw_preview(const Device& device, const Scene& scene, const RenderArguments& arguments,
                  PictureOptions options, Session& session) {
  constexpr int kReduction = 4, kWidest = 320;  // pixels
  const int reduction = std::max(kReduction, (options.width + kWidest - 1) / kWidest);
  options.width = std::max(1, options.width / reduction);
  options.height = std::max(1, options.height / reduction);
  options.samples = 1;
  const Image image =
      studio_of(device, scene, options, session).picture(options.camera, session.monitor());
  const auto path = preview_path(arguments.output.path);
  write_picture(image, path, {{kPreviewNote, true}});
  session.console.note(fmt::format("preview: {}, {:.1f} s", path.string(), session.seconds()));
  session.written_so_far = "only the preview was written";
}

std::vector<base::Output> outputs_of(const RenderArguments& arguments,
                                     const std::optional<Sweep>& sweep) {
  std::vector<base::Output> outputs{output_named("--output", arguments.output, {".png"})};
  if (arguments.preview) outputs.push_back({"--preview", preview_path(arguments.output.path)});
  if (!arguments.layers.empty()) {
    for (const auto& path : layer_files(arguments.layers)) outputs.push_back({"--aov", path});
  }
  for (std::size_t i = 1; sweep && i <= sweep->values.size(); ++i) {
    outputs.push_back(output_named(
        "the sweep's picture",
        {frame_path(arguments.output.path, i).string(), arguments.output.must_be_new}));
  }
  return outputs;
}

/// Tells of a picture as a part of all, `done` of which came before it.
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

bool has_range(const PictureOptions& options) { return options.material != Material::clay; }

/// The options, with the camera's place, the exposure and the range that the palette was spread
/// over.
PictureOptions as_drawn(PictureOptions options, Studio& studio) {
  const std::optional<UpAxis> up = options.camera.up;
  options.camera = studio.aimed(std::span(&options.camera, 1)).front();
  options.camera.up = up;
  options.exposure = studio.exposure();
  if (has_range(options)) options.range = studio.range();
  return options;
}

/// What is drawn, and into which files.
struct RenderPlan : Plan {
  PictureOptions options;
  std::optional<Sweep> sweep;
};

RenderPlan plan_render(const RenderArguments& arguments) {
  RenderPlan plan;
  plan.options = checked_options(arguments);
  plan.sweep = wanted_sweep(arguments.sweep, arguments.input, arguments.map_options,
                            arguments.camera, plan.options);
  if (plan.sweep && (!arguments.layers.empty() || arguments.preview)) {
    throw InputError("--aov and --preview need a single picture, without --sweep and --turntable");
  }
  plan.inputs = {arguments.input};
  plan.outputs = outputs_of(arguments, plan.sweep);
  return plan;
}

/// The cameras of a sweep.
std::vector<Camera> cameras_of(const Sweep& sweep, const PictureOptions& options) {
  std::vector<Camera> cameras;
  for (const double value : sweep.values) {
    MapOptions unused;
    PictureOptions changed = options;
    if (sweep.is_of_camera()) sweep.set(value, unused, changed);
    cameras.push_back(changed.camera);
  }
  return cameras;
}

/// What all pictures of a sweep over maps have in common: cameras that show the whole set in each,
/// and a palette that is spread over all of them. Both are found from drafts, for at most this many
/// values.
struct Series {
  std::vector<Camera> cameras;
  std::optional<MaterialRange> range;
};

Series series_of(const RenderArguments& arguments, const PictureOptions& options,
                 const Sweep& sweep, const Device& device, const Scene& scene, Session& session) {
  constexpr std::size_t kMostDrafts = 48;
  const TraceStage stage(session.trace(), "series");
  Series series{cameras_of(sweep, options), options.range};
  const bool is_placed = options.camera.look_at && options.camera.distance;
  const bool needs_range = has_range(options) && !options.range;
  if (is_placed && !needs_range) return series;
  const std::size_t drafts = std::min(kMostDrafts, sweep.values.size());
  std::vector<Eigen::Vector3d> seen;
  std::vector<float> shown;
  std::optional<Studio> studio;
  for (std::size_t i = 0; i < drafts; ++i) {
    const double done = static_cast<double>(i) / static_cast<double>(drafts);
    session.monitor().report({"looking at the series", done, -1, {}});
    MapOptions map_options = arguments.map_options;
    PictureOptions draft = options;
    const std::size_t number = drafts == 1 ? 0 : i * (sweep.values.size() - 1) / (drafts - 1);
    sweep.set(sweep.values[number], map_options, draft);
    const Scene turned_scene =
        turned(device, scene, arguments.input, {map_options, draft}, session);
    studio = Studio::of_drafts(device, *turned_scene.map, draft, session.stop());
    if (!is_placed) {
      const std::vector<Eigen::Vector3d> outline = studio->outline();
      seen.insert(seen.end(), outline.begin(), outline.end());
    }
    if (!needs_range) continue;
    const std::vector<float> values = studio->shown(std::span(&draft.camera, 1));
    shown.insert(shown.end(), values.begin(), values.end());
  }
  series.cameras = studio->aimed(series.cameras, seen);
  if (needs_range) series.range = range_over(std::move(shown), options.material);
  return series;
}

/// A picture for each value, numbered, and all of them with captions on one sheet.
int run_sweep(const RenderArguments& arguments, const RenderPlan& plan, Session& session) {
  const PictureOptions& options = plan.options;
  const Sweep& sweep = *plan.sweep;
  const Scene scene = read_scene(arguments, session);
  const Device device = session.open_device(arguments.device);
  Scene shown;
  std::vector<Image> frames;
  std::vector<std::string> files;
  std::optional<Studio> studio;
  Series series;
  if (sweep.is_of_camera()) {
    shown = turned(device, scene, arguments.input, {arguments.map_options, options}, session);
    studio = studio_of(device, shown, options, session);
    series = {studio->aimed(cameras_of(sweep, options)), {}};
    if (has_range(options) && !options.range) {
      studio->set_range(range_over(studio->shown(series.cameras), options.material));
    }
  } else {
    series = series_of(arguments, options, sweep, device, scene, session);
  }
  std::optional<double> exposure = options.exposure;  // that of the first picture of something
  const int reduction = sheet_reduction(options, sweep.values.size());
  for (const double value : sweep.values) {
    const std::string caption = fmt::format("{} {:.4g}", sweep.name, value);
    session.console.note(
        fmt::format("picture {} of {}: {}", frames.size() + 1, sweep.values.size(), caption));
    MapOptions map_options = arguments.map_options;
    PictureOptions frame_options = options;
    if (exposure) frame_options.exposure = exposure;
    sweep.set(value, map_options, frame_options);
    frame_options.camera = series.cameras[frames.size()];
    if (!sweep.is_of_camera()) {
      frame_options.range = series.range;
      shown = turned(device, scene, arguments.input, {map_options, frame_options}, session);
      studio = studio_of(device, shown, frame_options, session);
    }
    const Image image = studio->picture(frame_options.camera,
                                        part_monitor(session, frames.size(), sweep.values.size()));
    if (!exposure && image.covered > 0) {
      exposure = studio->exposure();
      studio->set_exposure(*exposure);
    }
    warn_if_empty(image, arguments.input, frame_options, session);
    if (image.loose.count > 0) session.console.note(left_out_text(image.loose));
    const PictureOptions drawn = as_drawn(frame_options, *studio);
    const Job job =
        frame_job(session.job(), {arguments.map_options, options}, {map_options, drawn});
    nlohmann::json how = made_with(job);
    how["picture"] = to_json(drawn);
    files.push_back(frame_path(arguments.output.path, files.size() + 1).string());
    {
      const TraceStage stage(session.trace(), "write");
      write_picture(image, files.back(), how, carried_map(shown, arguments, map_options, job));
    }
    session.written_so_far = fmt::format("{} pictures were written", files.size());
    frames.push_back(captioned(reduced(image, reduction), caption));
  }
  const auto count = static_cast<int>(frames.size());
  nlohmann::json how = made_with(session.job());
  how["picture"] = to_json(options);
  how["sweep"] = {{"name", sweep.name}, {"values", sweep.values}};
  write_picture(contact_sheet(frames, sheet_columns(count)), arguments.output.path, how);
  session.report_kernels(device);
  const double seconds = session.seconds();
  session.console.summary(fmt::format("{} pictures, {:.1f} s\nsheet: {}\npictures: {} to {}", count,
                                      seconds, arguments.output.path, files.front(), files.back()),
                          {{"sheet", arguments.output.path},
                           {"pictures", files},
                           {"made_with", how},
                           {"seconds", seconds}});
  return kDone;
}

int run_render(const RenderArguments& arguments, const RenderPlan& plan, Session& session) {
  const PictureOptions& options = plan.options;
  if (arguments.preview) check_preview(preview_path(arguments.output.path), session.stop());
  if (plan.sweep) return run_sweep(arguments, plan, session);
  Scene scene = read_scene(arguments, session);
  const Device device = session.open_device(arguments.device);
  scene =
      turned(device, std::move(scene), arguments.input, {arguments.map_options, options}, session);
  if (arguments.preview) draw_preview(device, scene, arguments, options, session);
  Studio studio = studio_of(device, scene, options, session);
  const auto [image, layers] =
      arguments.layers.empty() ? LayeredImage{studio.picture(options.camera, session.monitor()), {}}
                               : studio.layered_picture(options.camera, session.monitor());
  warn_if_empty(image, arguments.input, options, session);
  nlohmann::json how = made_with(session.job());
  how["picture"] = to_json(as_drawn(options, studio));
  const TraceStage stage(session.trace(), "write");
  write_picture(image, arguments.output.path, how,
                carried_map(scene, arguments, arguments.map_options, session.job()));
  std::vector<std::string> layer_files;
  if (!arguments.layers.empty()) {
    for (const auto& path : write_layers(layers, image.width, arguments.layers)) {
      layer_files.push_back(path.string());
    }
  }
  std::error_code ignored;
  if (arguments.preview) std::filesystem::remove(preview_path(arguments.output.path), ignored);
  if (const std::string lookups = to_text(studio.lookups()); !lookups.empty()) {
    session.console.detail(lookups);
  }
  session.report_kernels(device);
  const double seconds = session.seconds();
  const std::string of_layers =
      layer_files.empty() ? "" : fmt::format("\nlayers: {}", fmt::join(layer_files, " "));
  session.console.summary(
      fmt::format("{} x {} pixels, {:.1f} s{}\npicture: {}{}", image.width, image.height, seconds,
                  left_out_text(image.loose, "\n"), arguments.output.path, of_layers),
      {{"picture", arguments.output.path},
       {"layers", layer_files},
       {"width", image.width},
       {"height", image.height},
       {"covered_pixels", image.covered},
       {"loose_pieces", image.loose.count},
       {"loose_volume", image.loose.volume},
       {"made_with", how},
       {"seconds", seconds}});
  return kDone;
}

void describe_render(Command command, RenderArguments& a) {
  command
      .input("MAP", a.input,
             "Map file of 'qjulia fit' or 'qjulia shape'; or a mesh (" +
                 extension_list(FileContent::mesh, FileUse::read) +
                 "), drawn in the same light for comparison")
      .offers_files(readable({FileContent::map, FileContent::mesh}));
  command
      .output(
          "-o,--output", a.output, [&a] { return named_after(a.input, ".png"); }, "PICTURE",
          "Picture to write: .png." + named_text("input", ".png"))
      .offers_files({".png"});
  add_picture_setting(command, "size", a.options);
  add_picture_setting(command, "samples", a.options);
  a.camera = add_camera(command, a.options);
  add_picture_setting(command, "cut", a.options);
  command.word(
      "--sweep", "SWEEP", [&a](const std::string& text) { a.sweep.sweep = text; },
      std::string("Pictures for several values of one option, NAME=FROM:TO:COUNT or NAME=A,B,C: a "
                  "contact sheet in PICTURE, and each in PICTURE_001.png and on. NAME: ") +
          sweep_names());
  command
      .add("--turntable", &a.sweep.turntable, "N",
           "The same for N azimuths once around, 2 to 10000: the shape turns under steady light")
      .range(2, 10000);
  add_look_name(command, a.options);
  a.material = add_picture_setting(command, "material", a.options);
  command
      .file("--aov", a.layers, "PREFIX",
            "Also write what each pixel shows: PREFIX.depth.npy (along the ray from the camera, "
            "shape units, inf where nothing is), PREFIX.normal.npy and PREFIX.position.npy "
            "(shape coordinates), unfiltered; depth and normal also as .png to look at")
      .not_in_job();
  command.flag("--no-map", a.no_map,
               "Leave the map out of the picture. It takes 50 to 60 bytes a factor: 20 KB of 331 "
               "factors, 51 KB of 992");
  command
      .flag("--preview", a.preview,
            "First write a rough picture, up to 320 wide, as NAME.preview.png; it goes when the "
            "picture is done")
      .not_in_job();
  add_picture_setting(command, "exact", a.options);
  add_look(command, a.palette, a.options);
  add_map_options(command, a.map_options, picture_settings(), "pictures", a.options);
  add_device_to_use(command, a.device);
}

}  // namespace

void add_render(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"render", "Draw a picture of a map's set", std::string(R"(Examples:
  qjulia render bunny.qjulia.json -o bunny.png
  qjulia render bunny.qjulia.json -o ears.png --frame -0.8 0.6 -0.8 0.15 1 0.15
  qjulia render bunny.qjulia.json -o inside.png --cut z=50% --azimuth 0
  qjulia render bunny.obj -o mesh.png             the mesh in the same light
  qjulia render bunny.qjulia.json -o crust.png --drift 0.8 --detail 0.03
  qjulia render bunny.qjulia.json -o drift.png --sweep drift=0:1.05:12 --size 480x360
  qjulia render bunny.qjulia.json -o turn.png --turntable 36
  qjulia render bunny.qjulia.json -o cut_out.png --background transparent --no-ground
  qjulia render bunny.qjulia.json -o glow.png --material trap --palette ember
  qjulia render bunny.qjulia.json -o big.png --size 3840x2160 --preview --aov big
Rays meet the set itself, not a mesh of it: the picture is as sharp as its pixels. The set, without
loose pieces, stands in the middle and fills 83 % of the tighter side; a sweep or a turntable is
framed once for all its pictures. Rings on the faces of cuts show depth. The file holds
the map as it is drawn, with its knobs turned, so that every command that reads maps reads the
picture too; 'qjulia run' draws it again, and 'qjulia explore' opens the view. Of a series, each picture holds its map, and the contact sheet none. The file's text chunk
'qjulia' says how it was made.
)") + kMapOptionsHelp,
               /*can_trace=*/true,
               /*can_profile=*/true},
              describe_render, plan_render, run_render);
}

}  // namespace qjulia::tools
