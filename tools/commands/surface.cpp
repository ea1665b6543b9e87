/// qjulia surface: a map in, a mesh out.

#include "qjulia/surface/surface.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <future>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "base/file_types.hpp"
#include "commands/commands.hpp"
#include "describe/files.hpp"
#include "describe/map_options.hpp"
#include "describe/picture_options.hpp"
#include "describe/print_options.hpp"
#include "describe/provenance.hpp"
#include "describe/scatter_options.hpp"
#include "describe/setting_option.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/map_file.hpp"
#include "qjulia/mesh/moving_mesh.hpp"
#include "qjulia/picture/bake_texture.hpp"
#include "qjulia/picture/materials.hpp"
#include "qjulia/picture/picture.hpp"
#include "qjulia/picture/picture_settings.hpp"
#include "qjulia/picture/surface_colors.hpp"
#include "qjulia/surface/figures.hpp"
#include "qjulia/surface/print.hpp"
#include "qjulia/surface/selection.hpp"
#include "qjulia/surface/surface_file.hpp"
#include "qjulia/surface/surface_settings.hpp"
#include "volume/volume.hpp"

namespace qjulia::tools {
namespace {

struct SurfaceArguments {
  std::string map;
  OutputName output;
  TrustedDevice device;
  MapOptions map_options;
  SurfaceOptions options;
  Selection selection;
  bool no_map = false;
  PrintOptions print;
  std::optional<double> millimetres, metres;  ///< instead of shape units
  std::optional<UpAxis> up;  ///< instead of the map's; the file's, where it has no up of its own
  Material material = Material::clay;  ///< of the vertices' colours; clay: none
  std::optional<std::string> palette;
  std::optional<MaterialRange> range;
  std::optional<int> texture;  ///< pixels of its sides
  Scatter scatter;
  std::optional<Option> palette_option;
  std::optional<Option> range_option;
};

/// What was written.
struct WrittenSurface {
  SurfaceReport report;
  SurfaceFigures figures;
  std::size_t non_manifold_edges = 0;
  LoosePieces loose;  ///< not written
  PrintReport print;
  double abrupt_share = 0;  ///< of the edges, in colour
  std::size_t flying = 0;   ///< bodies that --scatter moves
};

/// Below this share, bands of a picture are still seen as bands.
constexpr double kMostAbrupt = 0.1;

bool has_colors(const SurfaceArguments& arguments) { return arguments.material != Material::clay; }

/// The types of meshes for which this holds, as in ".ply, .obj, .glb".
std::string types_that(const std::function<bool(const std::filesystem::path&)>& holds) {
  std::string list;
  for (const std::string& type : base::extensions(base::FileContent::mesh, base::FileUse::write)) {
    if (holds("a" + type)) list += (list.empty() ? "" : ", ") + type;
  }
  return list;
}

std::string colored_types() { return types_that(holds_colors); }

bool is_volume(const SurfaceArguments& arguments) {
  return base::has_type(arguments.output.path, base::FileContent::volume, base::FileUse::write);
}

/// Meshes, and volumes.
std::vector<std::string> surface_types() {
  auto types = base::extensions(base::FileContent::mesh, base::FileUse::write);
  std::ranges::copy(base::extensions(base::FileContent::volume, base::FileUse::write),
                    std::back_inserter(types));
  return types;
}

Palette chosen_palette(const SurfaceArguments& arguments) {
  return arguments.palette ? palette_of(*arguments.palette, arguments.material) : Palette{};
}

/// @throws InputError where colours are asked for that the file cannot hold, or a palette of no use
///   or that is none.
void check_colors(const SurfaceArguments& arguments) {
  if (has_colors(arguments) && !holds_colors(arguments.output.path)) {
    throw InputError(fmt::format("--material: {} files hold no colours; write {}",
                                 base::extension_of(arguments.output.path), colored_types()));
  }
  if (!has_colors(arguments) && arguments.palette_option->given()) {
    throw InputError(
        "--palette: a mesh of clay has no colours; give --material iterations or another, too");
  }
  if (!has_colors(arguments) && arguments.range_option->given()) {
    throw InputError(
        "--range: a mesh of clay has no colours; give --material iterations or another, too");
  }
  static_cast<void>(chosen_palette(arguments));
  SurfaceColorOptions{.range = arguments.range}.validate();
}

/// @throws OptionError naming the option if a texture has too few pixels for so many triangles.
void expect_pixels(int texture, std::size_t triangles) {
  try {
    expect_texture_size(texture, triangles);
  } catch (const OptionError& error) {
    throw OptionError("texture", error.problem());
  }
}

/// @throws InputError where a texture is asked for that the file cannot hold, that has too few
///   pixels for `--max-triangles`, or that what else is asked for would tear.
void check_texture(const SurfaceArguments& arguments) {
  if (!arguments.texture) return;
  if (!holds_textures(arguments.output.path)) {
    throw InputError(fmt::format("--texture: {} files hold no pictures; write .glb",
                                 base::extension_of(arguments.output.path)));
  }
  const PrintOptions& print = arguments.print;
  if (!arguments.selection.cuts.empty() || print.shell || print.flat_foot) {
    throw InputError(
        "--texture shows the set's own surface, and cut faces, feet and inner walls have none; "
        "leave --cut, --flat-foot and --shell out");
  }
  if (print.max_triangles) expect_pixels(*arguments.texture, *print.max_triangles);
}

/// @throws InputError where the file cannot hold bodies that move, or where another option needs a
/// mesh
///   that stands still
void check_scatter(const SurfaceArguments& arguments) {
  if (!arguments.scatter.field) return;
  arguments.scatter.options.validate();
  const std::string extension = base::extension_of(arguments.output.path);
  if (extension != ".glb" && extension != ".usda") {
    throw InputError(
        fmt::format("--scatter: {} files hold nothing that moves; write .glb or .usda", extension));
  }
  if (!arguments.selection.cuts.empty() || arguments.print.is_any() || arguments.texture ||
      arguments.selection.largest_component) {
    throw InputError(
        "--scatter moves the set's bodies as they are; leave --cut, --texture, --largest-component "
        "and the options of prints out");
  }
}

/// How the mesh is coloured.
SurfaceColorOptions color_options(const SurfaceArguments& arguments) {
  const SurfaceOptions& options = arguments.options;
  return {arguments.material, chosen_palette(arguments), options.iterations,
          options.escape,     options.precision,         arguments.range};
}

/// The map with shapes that are as long as was asked for; a box and cuts that were given go with
/// it.
Map scaled(Map map, SurfaceArguments& arguments) {
  if (!arguments.millimetres && !arguments.metres) return map;
  if (!map.frame.box) {
    throw InputError(fmt::format("{} needs the size of the shape, and '{}' does not hold it",
                                 arguments.metres ? "--metres" : "--millimetres", arguments.map));
  }
  const double length = arguments.metres ? *arguments.metres : *arguments.millimetres;
  const double factor = length / longest_side(map);
  std::optional<Box>& box = arguments.options.box;
  if (box) box = Box{factor * box->low, factor * box->high};
  for (Cut& cut : arguments.selection.cuts) {
    if (!cut.is_percent) cut.at *= factor;
  }
  return with_longest_side(std::move(map), length);
}

/// What the file says besides its triangles.
MeshFileOptions file_options(const SurfaceArguments& arguments, const Map& map,
                             const std::string& note) {
  MeshFileOptions options{.note = note, .up = map.frame.up, .name = named_after(arguments.map, "")};
  if (!format_up(arguments.output.path)) options.file_up = arguments.up;
  constexpr double kMillimetre = 1e-3;
  const PrintOptions& print = arguments.print;
  if (arguments.millimetres || print.height || print.longest) options.metres_per_unit = kMillimetre;
  if (arguments.metres) options.metres_per_unit = 1;
  if (base::extension_of(arguments.output.path) == ".glb" && !arguments.no_map) {
    options.map = packed_map(map);
  }
  return options;
}

/// Whether the mesh can go straight to its file: one that needs no counts first, and no colours,
/// which take the lengths of all edges about a vertex.
bool streams(const SurfaceArguments& arguments) {
  const Selection& selection = arguments.selection;
  return base::extension_of(arguments.output.path) == ".ply" && !selection.largest_component &&
         selection.min_component.value_or(0) == 0 && selection.cuts.empty() &&
         !arguments.print.is_any() && !has_colors(arguments) && !arguments.texture;
}

/// Straight to the file; the mesh is never in memory.
WrittenSurface stream(const SurfaceArguments& arguments, const Device& device, const Map& map,
                      const MeshFileOptions& about, const ProgressMonitor& monitor) {
  PlyFile file(arguments.output.path, about.note, about.file_turn());
  FigureSink sink(&file);
  WrittenSurface written;
  written.report = extract_surface(device, map, arguments.options, sink, monitor);
  if (written.report.triangles == 0) return written;
  const TraceStage stage(monitor.trace, "measure and write");
  if (arguments.selection.drops_loose()) written.loose = sink.drop_loose_pieces();
  std::future<SurfaceFigures> figures =
      std::async(std::launch::async, [&] { return sink.figures(); });
  if (written.loose.count > 0) {
    file.commit([&](std::uint32_t vertex) { return sink.keeps(vertex); });
  } else {
    file.commit();
  }
  written.figures = figures.get();
  written.report.vertices = written.figures.vertices;
  written.report.triangles = written.figures.triangles;
  return written;
}

/// A mesh whose coordinates are `scale` times those of the map's set, in the set's.
TriangleMesh in_shape_units(const TriangleMesh& mesh, double scale) {
  TriangleMesh set{mesh.vertices, mesh.triangles, mesh.normals};
  for (Eigen::Vector3d& x : set.vertices) x /= scale;
  return set;
}

/// The vertex colours or the texture of a finished mesh.
struct Dress {
  SurfaceColors colors;
  std::optional<MeshTexture> texture;
};

/// @param fine the mesh as it was before anything was done to it, shape units; none: it is `mesh`
/// @param mesh the mesh to write, `scale` times as large
Dress dress_of(const SurfaceArguments& arguments, const Device& device, const Map& map,
               const std::optional<TriangleMesh>& fine, const TriangleMesh& mesh, double scale,
               const ProgressMonitor& monitor) {
  Dress dress;
  if (!has_colors(arguments) && !arguments.texture) return dress;
  const TriangleMesh set = in_shape_units(mesh, scale);
  if (arguments.texture) {
    expect_pixels(*arguments.texture, mesh.triangles.size());
    TextureOptions options{.size = *arguments.texture};
    if (has_colors(arguments)) options.colors = color_options(arguments);
    dress.texture = bake_texture(device, map, fine ? *fine : set, set, options, monitor);
  } else {
    dress.colors = surface_colors(device, map, set, color_options(arguments), monitor);
  }
  return dress;
}

/// With the figures of the mesh that was written.
WrittenSurface measured(WrittenSurface written, const TriangleMesh& mesh) {
  const MeshReport report = inspect(mesh);
  written.report.vertices = report.vertices;
  written.report.triangles = report.triangles;
  written.report.open_edges = report.open_edges;
  written.non_manifold_edges = report.non_manifold_edges;
  written.figures = measure(mesh);
  return written;
}

/// Makes the mesh in memory: for formats that need their counts first, to choose among components,
/// to colour and to print.
WrittenSurface collect(const SurfaceArguments& arguments, const Device& device, const Map& map,
                       const MeshFileOptions& about, const ProgressMonitor& monitor) {
  WrittenSurface written;
  MeshSink sink;
  written.report = extract_surface(device, map, arguments.options, sink, monitor);
  TriangleMesh& mesh = sink.mesh;
  if (mesh.triangles.empty()) return written;
  const TraceStage stage(monitor.trace, "measure and write");
  Selection selection = arguments.selection;
  selection.keep_loose =
      selection.keep_loose || (arguments.scatter.field && selection.drops_loose());
  written.loose = select_parts(mesh, selection);
  std::optional<TriangleMesh> fine;
  if (arguments.texture && arguments.print.is_any()) fine = mesh;
  if (arguments.scatter.field) {
    mesh.colors = dress_of(arguments, device, map, {}, mesh, 1, monitor).colors.colors;
    const MovingMesh moving =
        scattered(mesh, arguments.scatter.chosen(), map.frame.up.value_or(kDefaultUp));
    write_moving_mesh(moving, arguments.output.path, about);
    written.flying = moving.bodies.size() - 1;
    return measured(written, mesh);
  }
  if (arguments.print.is_any()) {
    PrintOptions print = arguments.print;
    print.up = map.frame.up.value_or(kDefaultUp);
    print.keep_loose = arguments.selection.keep_loose || arguments.selection.min_component;
    PrintMesh made = made_printable(std::move(mesh), print, monitor);
    mesh = std::move(made.mesh);
    written.print = made.report;
  }
  Dress dress = dress_of(arguments, device, map, fine, mesh, written.print.scale, monitor);
  mesh.colors = std::move(dress.colors.colors);
  written.abrupt_share = dress.colors.abrupt_share;
  mesh = cut_open(std::move(mesh), arguments.selection, map.frame.box);
  if (is_volume(arguments)) {
    if (written.report.open_edges > 0) {
      throw InputError(
          fmt::format("'{}': a level set needs a closed surface, and --box cuts it "
                      "open; leave --box out, or write a mesh",
                      arguments.output.path));
    }
    const double voxel = mesh.box().size().maxCoeff() / arguments.options.resolution;
    volume::write_level_set(mesh, voxel, about.file_turn(), {about.name, about.note},
                            arguments.output.path);
  } else if (dress.texture) {
    write_textured_mesh(mesh, *dress.texture, arguments.output.path, about);
  } else {
    write_mesh(mesh, arguments.output.path, about);
  }
  return measured(written, mesh);
}

Plan plan_surface(const SurfaceArguments& arguments) {
  arguments.map_options.knobs.validate();
  arguments.options.validate();
  Plan plan{{arguments.map}, {output_named("--output", arguments.output, surface_types())}};
  check_colors(arguments);
  check_texture(arguments);
  check_scatter(arguments);
  arguments.print.validate();
  arguments.selection.validate();
  if (!arguments.selection.cuts.empty() && (arguments.print.is_any() || is_volume(arguments))) {
    throw InputError(
        "--cut opens the mesh, and prints and level sets need a closed one; leave --cut out");
  }
  return plan;
}

int run_surface(const SurfaceArguments& given, const Plan& /*plan*/, Session& session) {
  SurfaceArguments arguments = given;
  const SurfaceOptions& options = arguments.options;
  if (is_volume(arguments)) volume::expect_openvdb(arguments.output.path);
  const Map read = session.read_map(arguments.map);
  const Device device = session.open_device(arguments.device);
  Map map = scaled(with_knobs(device, read, arguments.map_options, arguments.map), arguments);
  warn_if_unbounded(map, options.iterations, arguments.map, session.console);
  const bool is_upright = format_up(arguments.output.path).has_value();
  // Maps that do not say it stand as they are drawn.
  if (is_upright) map.frame.up = arguments.up ? arguments.up : map.frame.up.value_or(kDefaultUp);

  const nlohmann::json how = made_with(session.job());
  add_job(map, session.job());
  const WrittenSurface written = (streams(arguments) ? stream : collect)(
      arguments, device, map, file_options(arguments, map, one_line(how)), session.monitor());
  const SurfaceReport& report = written.report;
  if (report.triangles == 0) {
    throw Error(
        has_points(device, map, options, session.stop())
            ? fmt::format("the set of '{}' is too thin for cells of this size; give a --resolution "
                          "higher than {}",
                          arguments.map, options.resolution)
            : fmt::format("the set of '{}' is empty in this box; try a smaller --detail, fewer "
                          "--iterations or another --box",
                          arguments.map));
  }
  const bool closed = report.open_edges == 0 && written.non_manifold_edges == 0;
  const std::size_t components = written.figures.components;
  std::string stands;
  if (is_upright) {
    stands = fmt::format("\nthe shape's {} is up", to_string(*map.frame.up));
  }
  if (!is_upright && arguments.up) {
    stands = fmt::format("\nthe file's {} is up", to_string(*arguments.up));
  }
  if (written.abrupt_share > kMostAbrupt) {
    session.console.warn(
        fmt::format("the pattern of --material {} is finer than the mesh: in a picture, colours "
                    "jump along {:.0f} % of its edges, so it shows dots or a mean colour instead "
                    "of bands; give a --resolution higher than {}, or a --material with a broader "
                    "pattern",
                    to_string(arguments.material), 100 * written.abrupt_share, options.resolution));
  }
  if (report.trusted_share > 0) {
    session.console.detail(to_text(LookupReport{report.nodes, report.trusted_share, 0}));
  }
  session.report_kernels(device);
  const double seconds = session.seconds();
  if (arguments.scatter.field) {
    stands += fmt::format("\nbodies that fly: {}; the largest stays", written.flying);
  }
  nlohmann::json print;
  if (arguments.print.is_any()) print = print_json(written.print, arguments.print);
  session.console.summary(
      fmt::format("{} vertices, {} triangles, {} component{}, {}; {:.1f} s{}{}\nmesh: {}",
                  report.vertices, report.triangles, components, components == 1 ? "" : "s",
                  closed ? "closed and manifold" : "not closed", seconds,
                  left_out_text(written.loose, "\n"),
                  print_text(written.print, arguments.print) + stands, arguments.output.path),
      {{"mesh", arguments.output.path},
       {"vertices", report.vertices},
       {"triangles", report.triangles},
       {"components", components},
       {"loose_pieces", written.loose.count},
       {"loose_volume", written.loose.volume},
       {"open_edges", report.open_edges},
       {"non_manifold_edges", written.non_manifold_edges},
       {"closed", closed},
       {"figures", to_json(written.figures)},
       {"print", print},
       {"flying", written.flying},
       {"made_with", how},
       {"resolution", options.resolution},
       {"points", to_json(report)},
       {"seconds", seconds}});
  return kDone;
}

void describe_surface(Command command, SurfaceArguments& a) {
  command.input("MAP", a.map, "Map file of 'qjulia fit' or 'qjulia shape'")
      .offers_files(readable({base::FileContent::map}));
  command
      .output(
          "-o,--output", a.output, [&a] { return named_after(a.map, ".ply"); }, "MESH",
          "Mesh to write: " + base::extension_list(base::FileContent::mesh, base::FileUse::write) +
              "; or .vdb, a level set of its surface for OpenVDB." + named_text("map", ".ply"))
      .offers_files(surface_types());
  const auto add = [&](const char* name) {
    const auto& setting = setting_named(surface_settings(), name, "surfaces");
    return add_setting(command, setting, setting.place(a.options));
  };
  add("resolution");
  add("refine");
  std::map<std::string, Option> parts;
  for (const auto& setting : selection_settings()) {
    parts.emplace(setting.name, add_setting(command, setting, setting.place(a.selection)));
  }
  parts.at("largest_component").excludes({parts.at("keep_loose")});
  parts.at("min_component").excludes({parts.at("largest_component"), parts.at("keep_loose")});
  const Option millimetres =
      command
          .add("--millimetres", &a.millimetres, "LENGTH",
               "Scale the mesh so that the fitted shape's longest side has this length, in "
               "millimetres")
          .range(1e-6, 1e9);
  const Option metres = command
                            .add("--metres", &a.metres, "LENGTH",
                                 "Like --millimetres, but in metres. Without either, a unit of the "
                                 "shape is a metre in .glb and "
                                 ".usda, and a millimetre in .3mf")
                            .excludes({millimetres})
                            .range(1e-9, 1e6);
  add_print_options(command, a.print, millimetres, metres);
  command.flag("--no-map", a.no_map,
               "Leave the map out of a .glb, which otherwise holds it, with its knobs turned, for "
               "every command that reads maps. It takes 50 to 60 bytes a factor: 20 KB of 331 "
               "factors, 51 KB of 992");
  add("exact");
  add("dense");
  const std::string shown =
      "What the colours of the vertices show, in " + colored_types() +
      " files: clay, no colours; or the same as in pictures: " + materials_help();
  add_setting(command, with_help(picture_setting_named("material"), shown), WordPlace(a.material));
  a.palette_option = add_palette(
      command, a.palette,
      fmt::format("The colours of --material: {}; or 2 to {} of your own with commas between, from "
                  "low to high",
                  fmt::join(palette_names(), ", "), Palette::kMostStops));
  a.range_option = add_setting(command, picture_setting_named("range"), &a.range);
  command
      .add(
          "--texture", &a.texture, "PIXELS",
          "Bake textures of PIXELS x PIXELS into the .glb: the normals of the mesh as it is before "
          "--max-triangles, and with --material its colours, in place of colours of the vertices. "
          "A light mesh then looks like the whole one. N triangles need at least 5.7 times the "
          "square root of N pixels: 50,000 need 1,272")
      .range(TextureOptions::kLeastSize, TextureOptions::kMostSize);
  add_scatter(command, a.scatter,
              "Let all connected parts but the largest fly, in an animation of the .glb or in time "
              "samples of the .usda: away from the middle, with a wind, or to the floor. Loose "
              "pieces are then kept. A large --drift or --detail makes many");
  const std::string upright =
      "In " + types_that([](const auto& path) { return format_up(path).has_value(); }) +
      " files, which stand upright, the shape's axis that points up; auto takes it from the map. "
      "In "
      "others, the axis of the file that the map's up axis is turned to; auto keeps the shape's "
      "own "
      "coordinates. Blender takes z for up in a .ply and y in an .obj";
  add_setting(command, with_help(picture_setting_named("up"), upright), &a.up);
  add_map_options(command, a.map_options, surface_settings(), "surfaces", a.options);
  add_device_to_use(command, a.device);
}

}  // namespace

void add_surface(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"surface", "Make a mesh of a map's set", std::string(R"(Examples:
  qjulia surface bunny.qjulia.json -o bunny.ply
  qjulia surface bunny.qjulia.json -o fine.stl --resolution 512 --detail 0.03
  qjulia surface bunny.qjulia.json -o print.3mf --height 80 --min-wall 0.8
  qjulia surface bunny.qjulia.json -o scene.glb --metres 0.2
  qjulia surface bunny.qjulia.json -o blender.ply --up z
  qjulia surface bunny.qjulia.json -o cloud.vdb
  qjulia surface bunny.qjulia.json -o light.glb --max-triangles 100000
  qjulia surface bunny.qjulia.json -o wild.ply --detail 0.03 --phase 0.8 0.6 0 0
  qjulia surface bunny.qjulia.json -o colours.glb --material trap --palette ember
  qjulia surface bunny.qjulia.json -o dust.glb --drift 0.9 --scatter wind
  qjulia surface bunny.qjulia.json -o baked.glb --max-triangles 20000 --texture 1024
The mesh lies in the fitted shape's own coordinates; .glb, .usda,
.stl and .3mf stand upright. Only the
undecided shell about the surface is iterated: time grows with its volume, memory with the
mesh and one slab.
)") + kMapOptionsHelp,
               /*can_trace=*/true,
               /*can_profile=*/true},
              describe_surface, plan_surface, run_surface);
}

}  // namespace qjulia::tools
