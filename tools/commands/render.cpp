/// qjulia render: a map (or a mesh, for comparison) in, a picture out.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "base/file_types.hpp"
#include "commands/commands.hpp"
#include "describe/files.hpp"
#include "describe/notes.hpp"
#include "describe/provenance.hpp"
#include "jobs/picture_series.hpp"
#include "jobs/picture_sweep.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/picture/picture.hpp"

namespace qjulia::tools {
namespace {

struct RenderArguments {
  std::string input;
  OutputName output;
  TrustedDevice device;
  SweepChoice sweep;
  std::string layers;  ///< prefix of their files; empty: none
  bool preview = false, no_map = false;
  ViewArguments view;
};

std::vector<std::string> picture_types() {
  return base::extensions(base::FileContent::picture, base::FileUse::write);
}

/// Whether the picture has layers, as an .exr.
bool is_layered(const RenderArguments& arguments) {
  return base::extension_of(arguments.output.path) == ".exr";
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
  std::vector<base::Output> outputs{output_named("--output", arguments.output, picture_types())};
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

/// What is drawn, and into which files.
struct RenderPlan : Plan {
  View view;
  std::optional<Sweep> sweep;
};

RenderPlan plan_render(const RenderArguments& arguments) {
  RenderPlan plan;
  plan.view = checked_view(arguments.view, arguments.input);
  plan.sweep = wanted_sweep(arguments.sweep, arguments.input, plan.view, arguments.view.camera);
  if (plan.sweep && (!arguments.layers.empty() || arguments.preview)) {
    throw InputError("--aov and --preview need a single picture, without --sweep and --turntable");
  }
  if (is_layered(arguments) && (plan.sweep || arguments.preview)) {
    throw InputError("an .exr is a single picture, without --sweep, --turntable and --preview");
  }
  plan.inputs = {arguments.input};
  plan.outputs = outputs_of(arguments, plan.sweep);
  return plan;
}

/// A picture for each value, numbered, and all of them with captions on one sheet.
int run_sweep(const RenderArguments& arguments, const RenderPlan& plan, Session& session) {
  const Sweep& sweep = *plan.sweep;
  Scene scene = read_scene(arguments.input, session);
  const Device device = session.open_device(arguments.device);
  PictureSeries series(device, std::move(scene), arguments.input, sweep.views(plan.view),
                       session.job(), session);
  std::vector<Image> frames;
  std::vector<std::string> files;
  const int reduction = sheet_reduction(plan.view.picture, series.size());
  for (const double value : sweep.values) {
    const std::string caption = fmt::format("{} {:.4g}", sweep.name, value);
    session.console.note(
        fmt::format("picture {} of {}: {}", frames.size() + 1, series.size(), caption));
    const PictureSeries::Picture made =
        series.picture(frames.size(), plan.view, !arguments.no_map,
                       part_monitor(session, frames.size(), series.size()));
    warn_if_empty(made.image, arguments.input, made.view.picture, session);
    if (made.image.loose.count > 0) session.console.note(left_out_text(made.image.loose));
    nlohmann::json how = made_with(made.job);
    how["picture"] = to_json(made.view.picture);
    if (made.view.scatter.field) how["scatter"] = to_json(made.view.scatter);
    files.push_back(frame_path(arguments.output.path, files.size() + 1).string());
    {
      const TraceStage stage(session.trace(), "write");
      write_picture(made.image, files.back(), how, made.map);
    }
    session.written_so_far = fmt::format("{} pictures were written", files.size());
    frames.push_back(captioned(reduced(made.image, reduction), caption));
  }
  const auto count = static_cast<int>(frames.size());
  nlohmann::json how = made_with(session.job());
  how["picture"] = to_json(plan.view.picture);
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
  const PictureOptions& options = plan.view.picture;
  if (arguments.preview) check_preview(preview_path(arguments.output.path), session.stop());
  if (plan.sweep) return run_sweep(arguments, plan, session);
  Scene scene = read_scene(arguments.input, session);
  const Device device = session.open_device(arguments.device);
  scene = turned(device, std::move(scene), arguments.input, plan.view, session);
  if (plan.view.scatter.field) {
    scene = Scatterer().at(device, std::move(scene), plan.view, session);
  }
  if (arguments.preview) draw_preview(device, scene, arguments, options, session);
  Studio studio = studio_of(device, scene, options, session);
  const LayeredImage drawn =
      arguments.layers.empty() && !is_layered(arguments)
          ? LayeredImage{studio.picture(options.camera, session.monitor()), {}}
          : studio.layered_picture(options.camera, session.monitor());
  const auto& [image, layers] = drawn;
  warn_if_empty(image, arguments.input, options, session);
  nlohmann::json how = made_with(session.job());
  how["picture"] = to_json(as_drawn(options, studio));
  if (plan.view.scatter.field) how["scatter"] = to_json(plan.view.scatter);
  const TraceStage stage(session.trace(), "write");
  if (is_layered(arguments)) {
    write_layered_picture(drawn, arguments.output.path, how);
  } else {
    write_picture(image, arguments.output.path, how,
                  arguments.no_map ? std::string()
                                   : carried_map(scene, plan.view.map_options, session.job()));
  }
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
                 base::extension_list(base::FileContent::mesh, base::FileUse::read) +
                 "), drawn in the same light for comparison")
      .offers_files(readable({base::FileContent::map, base::FileContent::mesh}));
  command
      .output(
          "-o,--output", a.output, [&a] { return named_after(a.input, ".png"); }, "PICTURE",
          "Picture to write: .png; or .exr, linear, with layers that compositors read: each lamp, "
          "sky, bounce, emission and background, whose sum it is, and Z, N, P, albedo, value and "
          "masks." +
              named_text("input", ".png"))
      .offers_files(picture_types());
  add_view(command, a.view);
  command.word(
      "--sweep", "SWEEP", [&a](const std::string& text) { a.sweep.sweep = text; },
      std::string("Pictures for several values of one option, NAME=FROM:TO:COUNT or NAME=A,B,C: a "
                  "contact sheet in PICTURE, and each in PICTURE_001.png and on. NAME: ") +
          sweep_names());
  command
      .add("--turntable", &a.sweep.turntable, "N",
           "The same for N azimuths once around, 2 to 10000: the shape turns under steady light")
      .range(2, 10000);
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
  qjulia render bunny.qjulia.json -o layers.exr --background transparent
  qjulia render bunny.qjulia.json -o cut_out.png --background transparent --no-ground
  qjulia render bunny.qjulia.json -o dust.png --drift 0.9 --scatter wind --scatter-time 2
  qjulia render bunny.qjulia.json -o glow.png --material trap --palette ember
  qjulia render bunny.qjulia.json -o big.png --size 3840x2160 --preview --aov big
Rays meet the set itself, not a mesh of it: the picture is as sharp as its pixels. The set, without
loose pieces, stands in the middle and fills 83 % of the tighter side; a sweep or a turntable is
framed once for all its pictures. Rings on the faces of cuts show depth. A .png holds the map
as it is drawn, with its knobs turned, so that every command that reads maps reads the picture too;
'qjulia run' draws it again, and 'qjulia explore' opens the view. Of a series, each picture holds
its map, and the contact sheet none. The text 'qjulia' in a .png or an .exr says how it was made.
)") + kMapOptionsHelp,
               /*can_trace=*/true,
               /*can_profile=*/true},
              describe_render, plan_render, run_render);
}

}  // namespace qjulia::tools
