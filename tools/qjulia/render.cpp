/// qjulia render: a map (or a mesh, for comparison) in, a picture out.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <vector>

#include "base/text.hpp"
#include "commands.hpp"
#include "files.hpp"
#include "map_options.hpp"
#include "picture_options.hpp"
#include "provenance.hpp"
#include "qjulia/error.hpp"
#include "qjulia/file_types.hpp"
#include "qjulia/knob_table.hpp"
#include "qjulia/picture.hpp"
#include "qjulia/picture_settings.hpp"

namespace qjulia::tools {
namespace {

struct RenderArguments {
  std::string input;
  OutputName output;
  DeviceChoice device;
  std::optional<std::string> sweep;
  std::optional<int> turntable;
  std::string layers;  ///< prefix of their files; empty: none
  bool preview = false;
  MapOptions map_options;
  LookOptions look;
  PictureOptions options;
  std::vector<Option> camera;
};

/// "z=50%,x=0.2": axes, and where they are cut.
std::vector<Cut> parse_cuts(const std::string& text) {
  std::vector<Cut> cuts;
  for (std::string word : base::split(text, ',')) {
    if (word.size() < 3 || word[0] < 'x' || word[0] > 'z' || word[1] != '=') {
      throw InputError(fmt::format("'{}' is not AXIS=PLACE, such as z=50% or x=0.2", word));
    }
    Cut cut{word[0], 0, word.back() == '%'};
    if (cut.is_percent) word.pop_back();
    cut.at = finite_number(word.substr(2));
    cuts.push_back(cut);
  }
  return cuts;
}

constexpr int kMostFrames = 10000;

/// One option taken through a list of values: a picture for each.
struct Sweep {
  std::string name;  ///< the option's, without dashes
  std::vector<double> values;
};

/// Sets the option. @throws InputError for a value that it cannot have.
using Setter = std::function<void(double, MapOptions&, PictureOptions&)>;
using Setters = std::map<std::string, Setter>;

/// cos A + u sin A, for a unit vector along `axis` (1: i, 2: j, 3: k) and A in degrees.
Quaternion turned_phase(int axis, double degrees) {
  const double angle = degrees * std::numbers::pi / 180;
  Quaternion phase{std::cos(angle), 0, 0, 0};
  (axis == 1 ? phase.y : axis == 2 ? phase.z : phase.w) = std::sin(angle);
  return phase;
}

double whole(double value) {
  if (value == std::round(value) && std::abs(value) <= 1e9) return value;
  throw InputError(fmt::format("{} is not a whole number", value));
}

/// What of a knob can be swept: its number, or the angle of a turn about each axis.
class KnobSetters {
 public:
  KnobSetters(const Knob& knob, Setters& setters) : knob_(knob), setters_(setters) {}

  void operator()(std::optional<double> MapKnobs::*member) const {
    setters_[knob_.option()] = [this_knob = &knob_, member](double v, MapOptions& m,
                                                            PictureOptions&) {
      this_knob->expect_in_range(v);
      m.knobs.*member = v;
    };
  }
  void operator()(std::optional<std::uint64_t> MapKnobs::*member) const {
    setters_[knob_.option()] = [this_knob = &knob_, member](double v, MapOptions& m,
                                                            PictureOptions&) {
      this_knob->expect_in_range(whole(v));
      m.knobs.*member = static_cast<std::uint64_t>(v);
    };
  }
  void operator()(std::optional<Quaternion> MapKnobs::*member) const {
    for (const int axis : {1, 2, 3}) {
      setters_[fmt::format("{}-{}", knob_.option(), "-ijk"[axis])] =
          [member, axis](double v, MapOptions& m, PictureOptions&) {
            m.knobs.*member = turned_phase(axis, v);
          };
    }
  }
  void operator()(std::optional<Eigen::Vector3d> MapKnobs::*) const {}
  void operator()(std::optional<Rotation> MapKnobs::*) const {}

 private:
  const Knob& knob_;
  Setters& setters_;
};

const Setters& setters() {
  static const Setters all = [] {
    Setters made;
    for (const Knob& knob : knob_table()) std::visit(KnobSetters(knob, made), knob.value);
    for (const PictureSetting& setting : picture_settings()) {
      if (const auto* place = std::get_if<double& (*)(PictureOptions&)>(&setting.value)) {
        made[setting.option()] = [place = *place](double v, MapOptions&, PictureOptions& p) {
          place(p) = v;
        };
      }
    }
    made["iterations"] = [](double v, MapOptions& m, PictureOptions& p) {
      m.iterations = p.iterations = static_cast<int>(whole(v));
    };
    return made;
  }();
  return all;
}

InputError unreadable(const std::string& text) {
  return InputError(fmt::format(
      "--sweep '{}' is neither NAME=FROM:TO:COUNT, such as drift=0:1.05:12, nor NAME=A,B,C", text));
}

std::vector<double> numbers(const std::string& list, char between, const std::string& whole_text) {
  std::vector<double> values;
  for (const std::string& word : base::split(list, between)) {
    const auto value = base::number_in<double>(word);
    if (!value || !std::isfinite(*value)) throw unreadable(whole_text);
    values.push_back(*value);
  }
  return values;
}

/// What can be swept, for help and errors.
std::string sweep_names() {
  std::vector<std::string> names;
  for (const auto& [name, setter] : setters()) names.push_back(name);
  return fmt::format("{}; phase-i is the phase cos A + i sin A, A in degrees",
                     fmt::join(names, ", "));
}

/// "NAME=FROM:TO:COUNT", both ends included, or "NAME=A,B,C". @throws InputError
Sweep parse_sweep(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) throw unreadable(text);
  Sweep sweep{text.substr(0, equals), {}};
  if (!setters().contains(sweep.name)) {
    throw InputError(
        fmt::format("--sweep: there is no '{}' to sweep; it can be {}", sweep.name, sweep_names()));
  }
  const std::string list = text.substr(equals + 1);
  if (list.find(':') == std::string::npos) {
    sweep.values = numbers(list, ',', text);
    return sweep;
  }
  const auto range = numbers(list, ':', text);
  if (range.size() != 3 || range[2] != std::round(range[2])) throw unreadable(text);
  if (range[2] < 2 || range[2] > kMostFrames) {
    throw InputError(fmt::format("--sweep {}: COUNT is 2 to {}", text, kMostFrames));
  }
  const int count = static_cast<int>(range[2]);
  for (int i = 0; i < count; ++i) {
    sweep.values.push_back(std::lerp(range[0], range[1], double(i) / (count - 1)));
  }
  return sweep;
}

/// `count` azimuths once around, from `first` on.
Sweep turntable(double first, int count) {
  Sweep sweep{"azimuth", {}};
  for (int i = 0; i < count; ++i) sweep.values.push_back(first + 360.0 * i / count);
  return sweep;
}

/// Whether only the camera moves.
bool is_of_camera(const Sweep& sweep) {
  const auto found = std::ranges::find_if(
      picture_settings(), [&](const auto& setting) { return setting.option() == sweep.name; });
  return found != picture_settings().end() && found->is_of_camera;
}

PictureOptions checked_options(const RenderArguments& arguments) {
  PictureOptions options =
      checked(with_look(arguments.options, arguments.look), arguments.map_options);
  auto given = arguments.map_options.given();
  if (!options.cuts.empty()) given.emplace_back("--cut");
  if (!given.empty()) expect_map(given.front(), arguments.input);
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
  Map map;
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

Studio studio_of(const Device& device, const Scene& scene, const std::string& input,
                 const MapOptions& map_options, const PictureOptions& options, Session& session) {
  const TraceStage stage(session.trace(), "studio");
  if (is_mesh_file(input)) return {device, scene.mesh, scene.mesh.box(), options};
  return {device, with_knobs(device, scene.map, map_options, input), options,
          session.interrupts.token()};
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
  options.samples_per_axis = 1;
  const Image image =
      studio_of(device, scene, arguments.input, arguments.map_options, options, session)
          .picture(options.camera, session.monitor());
  const auto path = preview_path(arguments.output.path);
  write_picture(image, path, {{kPreviewNote, true}});
  session.console.note(fmt::format("preview: {}, {:.1f} s", path.string(), session.seconds()));
  session.written_so_far = "only the preview was written";
}

/// @throws InputError where the option that is swept has a value of its own too.
void expect_not_given(const RenderArguments& arguments, const std::string& swept) {
  for (const auto& options : {arguments.camera, arguments.map_options.options}) {
    for (const Option& option : options) {
      if (option.name() != swept || !option.given()) continue;
      throw InputError(fmt::format("--sweep sets {} for each picture; leave out {}", swept, swept));
    }
  }
}

std::optional<Sweep> wanted_sweep(const RenderArguments& arguments, const PictureOptions& options) {
  if (arguments.sweep && arguments.turntable) {
    throw InputError("give either --sweep or --turntable");
  }
  if (arguments.turntable) return turntable(options.camera.azimuth, *arguments.turntable);
  if (!arguments.sweep) return std::nullopt;
  Sweep sweep = parse_sweep(*arguments.sweep);
  const bool is_phase = sweep.name.starts_with("phase-");
  expect_not_given(arguments, is_phase ? "--phase" : "--" + sweep.name);
  // Refused before the first picture is drawn, not after some.
  for (const double value : sweep.values) {
    MapOptions map_options = arguments.map_options;
    PictureOptions changed = options;
    try {
      setters().at(sweep.name)(value, map_options, changed);
    } catch (const InputError& error) {
      throw InputError(fmt::format("--sweep {}: {}", sweep.name, error.what()));
    }
    map_options.knobs.validate();
    changed.validate();
  }
  if (!is_of_camera(sweep)) expect_map("--sweep " + sweep.name, arguments.input);
  return sweep;
}

/// "sheet.png" and 7: "sheet_007.png".
std::filesystem::path frame_path(const std::filesystem::path& sheet, std::size_t number) {
  return sheet.parent_path() /
         fmt::format("{}_{:03}{}", sheet.stem().string(), number, sheet.extension().string());
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

/// One row of up to five pictures; else nearly as many rows as columns, with few cells empty.
int sheet_columns(int count) {
  if (count <= 5) return count;
  const int least = static_cast<int>(std::ceil(std::sqrt(count)));
  const auto empty = [count](int columns) { return (columns - count % columns) % columns; };
  return std::min({least, least + 1, least + 2}, [&](int a, int b) { return empty(a) < empty(b); });
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

/// How many times narrower and lower pictures are on a sheet than alone, since the sheet is made in
/// memory and a .png has its limits.
int sheet_reduction(const PictureOptions& options, std::size_t count) {
  constexpr double kMostPixels = 3e8;
  const double pixels = static_cast<double>(count) * options.width * options.height;
  return std::max(1, static_cast<int>(std::ceil(std::sqrt(pixels / kMostPixels))));
}

bool has_range(const PictureOptions& options) { return options.material != Material::clay; }

/// The options, with the range that the palette was spread over.
PictureOptions with_range(PictureOptions options, const Studio& studio) {
  if (has_range(options)) options.range = studio.range();
  return options;
}

/// A picture for each value, numbered, and all of them with captions on one sheet.
int run_sweep(const RenderArguments& arguments, const PictureOptions& options, const Sweep& sweep,
              Session& session) {
  const Scene scene = read_scene(arguments, session);
  const Device device = session.open_device(arguments.device);
  std::vector<Image> frames;
  std::vector<std::string> files;
  nlohmann::json how;
  std::optional<Studio> studio;
  std::optional<MaterialRange> range = options.range;
  const int reduction = sheet_reduction(options, sweep.values.size());
  for (const double value : sweep.values) {
    const std::string caption = fmt::format("{} {:.4g}", sweep.name, value);
    session.console.note(
        fmt::format("picture {} of {}: {}", frames.size() + 1, sweep.values.size(), caption));
    MapOptions map_options = arguments.map_options;
    PictureOptions frame_options = options;
    setters().at(sweep.name)(value, map_options, frame_options);
    frame_options.range = range;  // colours stay from picture to picture
    if (!studio || !is_of_camera(sweep)) {
      studio = studio_of(device, scene, arguments.input, map_options, frame_options, session);
    }
    if (has_range(options)) range = studio->range();
    const Image image = studio->picture(frame_options.camera,
                                        part_monitor(session, frames.size(), sweep.values.size()));
    warn_if_empty(image, arguments.input, frame_options, session);
    if (image.loose.count > 0) session.console.note(left_out_text(image.loose));
    how = made_with(arguments.input, map_options, device.info());
    how["picture"] = to_json(with_range(frame_options, *studio));
    files.push_back(frame_path(arguments.output.path, files.size() + 1).string());
    {
      const TraceStage stage(session.trace(), "write");
      write_picture(image, files.back(), how);
    }
    session.written_so_far = fmt::format("{} pictures were written", files.size());
    frames.push_back(captioned(reduced(image, reduction), caption));
  }
  const auto count = static_cast<int>(frames.size());
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

int run_render(const RenderArguments& arguments, Session& session) {
  const PictureOptions options = checked_options(arguments);
  const auto sweep = wanted_sweep(arguments, options);
  if (sweep && (!arguments.layers.empty() || arguments.preview)) {
    throw InputError("--aov and --preview need a single picture, without --sweep and --turntable");
  }
  session.check_outputs({arguments.input}, outputs_of(arguments, sweep));
  if (arguments.preview)
    check_preview(preview_path(arguments.output.path), session.interrupts.token());
  if (sweep) return run_sweep(arguments, options, *sweep, session);
  const Scene scene = read_scene(arguments, session);
  const Device device = session.open_device(arguments.device);

  if (arguments.preview) draw_preview(device, scene, arguments, options, session);
  Studio studio =
      studio_of(device, scene, arguments.input, arguments.map_options, options, session);
  const auto [image, layers] =
      arguments.layers.empty() ? LayeredImage{studio.picture(options.camera, session.monitor()), {}}
                               : studio.layered_picture(options.camera, session.monitor());
  warn_if_empty(image, arguments.input, options, session);
  nlohmann::json how = made_with(arguments.input, arguments.map_options, device.info());
  how["picture"] = to_json(with_range(options, studio));
  const TraceStage stage(session.trace(), "write");
  write_picture(image, arguments.output.path, how);
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
                 "), drawn in the same view and light for comparison")
      .offers_files(readable({FileContent::map, FileContent::mesh}));
  command
      .output(
          "-o,--output", a.output, [&a] { return named_after(a.input, ".png"); }, "PICTURE",
          "Picture to write: .png." + named_text("input", ".png"))
      .offers_files({".png"});
  add_size(command, a.options);
  command.add("--samples", &a.options.samples_per_axis, "INT",
              "Anti-aliasing: N x N rays per pixel");
  a.camera = add_camera(command, a.options);
  command.word(
      "--cut", "AXIS=PLACE", [&a](const std::string& text) { a.options.cuts = parse_cuts(text); },
      "Cut away what lies beyond a place along an axis, and show the inside: a coordinate, shape "
      "units, or per cent of the shape's box; several with commas, x=0.2,z=50%");
  command.word(
      "--sweep", "SWEEP", [&a](const std::string& text) { a.sweep = text; },
      std::string("Pictures for several values of one option, NAME=FROM:TO:COUNT or NAME=A,B,C: a "
                  "contact sheet in PICTURE, and each in PICTURE_001.png and on. NAME: ") +
          sweep_names());
  command
      .add("--turntable", &a.turntable, "N",
           "The same for N azimuths once around, 2 to 10000: the shape turns under steady light")
      .range(2, 10000);
  add_material(command, a.options);
  command.file("--aov", a.layers, "PREFIX",
               "Also write what each pixel shows: PREFIX.depth.npy (along the ray from the camera, "
               "shape units, inf where nothing is), PREFIX.normal.npy and PREFIX.position.npy "
               "(shape coordinates), unfiltered; depth and normal also as .png to look at");
  command.flag("--preview", a.preview,
               "First write a rough picture, up to 320 wide, as NAME.preview.png; it goes when the "
               "picture is done");
  command.flag(
      "--exact", a.options.exact,
      "Compute every orbit, instead of looking iterates up in tables where that moves what "
      "is seen by no more than about an eighth of a pixel: up to three times slower for maps of "
      "many factors");
  add_look(command, a.look, a.options);
  add_map_options(command, a.map_options, "The set is cut open at its faces. Default: all of it");
  add_device(command, a.device);
}

}  // namespace

void add_render(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"render", "Draw a picture of a map's set", std::string(R"(Examples:
  qjulia render bunny.qjulia.json -o bunny.png
  qjulia render bunny.qjulia.json -o ears.png --frame -0.8 0.6 -0.8 0.15 1 0.15
  qjulia render bunny.qjulia.json -o inside.png --cut z=50% --azimuth 0
  qjulia render bunny.obj -o mesh.png             the mesh in the same view
  qjulia render bunny.qjulia.json -o crust.png --drift 0.8 --detail 0.03
  qjulia render bunny.qjulia.json -o drift.png --sweep drift=0:1.05:12 --size 480x360
  qjulia render bunny.qjulia.json -o turn.png --turntable 36
  qjulia render bunny.qjulia.json -o cut_out.png --background transparent --no-ground
  qjulia render bunny.qjulia.json -o glow.png --material trap --palette ember
  qjulia render bunny.qjulia.json -o big.png --size 3840x2160 --preview --aov big
Rays meet the set itself, not a mesh of it: the picture is as sharp as its pixels. The file's
text chunk 'qjulia' says how it was made.
)") + kMapOptionsHelp,
               /*can_trace=*/true,
               /*can_profile=*/true},
              describe_render, run_render);
}

}  // namespace qjulia::tools
