/// qjulia surface: a map in, a mesh out.

#include "qjulia/surface.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <future>
#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "files.hpp"
#include "map_options.hpp"
#include "picture_options.hpp"
#include "print_options.hpp"
#include "provenance.hpp"
#include "qjulia/error.hpp"
#include "qjulia/figures.hpp"
#include "qjulia/file_types.hpp"
#include "qjulia/picture.hpp"
#include "qjulia/print.hpp"
#include "qjulia/surface_colors.hpp"
#include "qjulia/surface_file.hpp"
#include "setting_json.hpp"

namespace qjulia::tools {
namespace {

struct SurfaceArguments {
  std::string map;
  OutputName output;
  DeviceChoice device;
  MapOptions map_options;
  SurfaceOptions options;
  bool keep_loose = false, largest_component = false;
  std::optional<double> min_component;  ///< least area kept, over the largest one's
  PrintOptions print;
  std::optional<double> millimetres;   ///< instead of shape units
  std::optional<UpAxis> up;            ///< instead of the map's; of files that stand upright
  Material material = Material::clay;  ///< of the vertices' colours; clay: none
  std::string palette = "earth";
  std::optional<Option> palette_option;
};

/// What was written.
struct WrittenSurface {
  SurfaceReport report;
  SurfaceFigures figures;
  std::size_t non_manifold_edges = 0;
  LoosePieces loose;  ///< not written
  PrintReport print;
};

bool has_colors(const SurfaceArguments& arguments) { return arguments.material != Material::clay; }

/// @throws InputError where colours are asked for that the file cannot hold, or a palette of no use
///   or that is none.
void check_colors(const SurfaceArguments& arguments) {
  if (has_colors(arguments) && !holds_colors(arguments.output.path)) {
    throw InputError(fmt::format("--material: {} files hold no colours; write .ply, .glb or .obj",
                                 extension_of(arguments.output.path)));
  }
  if (!has_colors(arguments) && arguments.palette_option->given()) {
    throw InputError(
        "--palette: a mesh of clay has no colours; give --material iterations or trap, too");
  }
  static_cast<void>(palette_of(arguments.palette, arguments.material));
}

/// How the mesh is coloured.
SurfaceColorOptions color_options(const SurfaceArguments& arguments,
                                  const SurfaceOptions& options) {
  return {arguments.material, palette_of(arguments.palette, arguments.material), options.iterations,
          options.escape, options.precision};
}

/// The map with shapes that are as long as was asked for; a box that was given goes with it.
Map scaled(Map map, std::optional<double> millimetres, const std::string& file,
           SurfaceOptions& options) {
  if (!millimetres) return map;
  if (!map.frame.box) {
    throw InputError(
        fmt::format("--millimetres needs the size of the shape, and '{}' does not hold it", file));
  }
  const double factor = *millimetres / longest_side(map);
  if (options.box) options.box = Box{factor * options.box->low, factor * options.box->high};
  return with_longest_side(std::move(map), *millimetres);
}

/// Loose pieces are dropped unless components are chosen otherwise.
bool drops_loose(const SurfaceArguments& arguments) {
  return !arguments.keep_loose && !arguments.largest_component && !arguments.min_component;
}

/// Whether the mesh can go straight to its file: one that needs no counts first, and whole. Colours
/// are spread over what occurs in all of it.
bool streams(const SurfaceArguments& arguments) {
  return extension_of(arguments.output.path) == ".ply" && !arguments.largest_component &&
         arguments.min_component.value_or(0) == 0 && !arguments.print.is_any() &&
         !has_colors(arguments);
}

/// Straight to the file; the mesh is never in memory.
WrittenSurface stream(const SurfaceArguments& arguments, const Device& device, const Map& map,
                      const SurfaceOptions& options, const std::string& note,
                      const ProgressMonitor& monitor) {
  PlyFile file(arguments.output.path, note);
  FigureSink sink(&file);
  WrittenSurface written;
  written.report = extract_surface(device, map, options, sink, monitor);
  if (written.report.triangles == 0) return written;
  const TraceStage stage(monitor.trace, "measure and write");
  if (drops_loose(arguments)) written.loose = sink.drop_loose_pieces();
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

/// Colours of a mesh whose coordinates are `scale` times those of the map's set.
std::vector<VertexColor> colors_of(const SurfaceArguments& arguments, const Device& device,
                                   const Map& map, const SurfaceOptions& options,
                                   const TriangleMesh& mesh, double scale,
                                   const ProgressMonitor& monitor) {
  const SurfaceColorOptions wanted = color_options(arguments, options);
  if (scale == 1) return surface_colors(device, map, mesh, wanted, monitor).colors;
  TriangleMesh set{mesh.vertices, mesh.triangles};
  for (Eigen::Vector3d& x : set.vertices) x /= scale;
  return surface_colors(device, map, set, wanted, monitor).colors;
}

/// By way of memory: for formats that need their counts first, to choose among components, to
/// colour and to print.
WrittenSurface collect(const SurfaceArguments& arguments, const Device& device, const Map& map,
                       const SurfaceOptions& options, const std::string& note,
                       const ProgressMonitor& monitor) {
  WrittenSurface written;
  MeshSink sink;
  written.report = extract_surface(device, map, options, sink, monitor);
  TriangleMesh& mesh = sink.mesh;
  if (mesh.triangles.empty()) return written;
  const double least = arguments.largest_component ? 1 : arguments.min_component.value_or(0);
  const TraceStage stage(monitor.trace, "measure and write");
  if (drops_loose(arguments)) written.loose = drop_loose_pieces(mesh);
  if (least > 0) mesh = large_components(mesh, least);
  if (arguments.print.is_any()) {
    PrintOptions print = arguments.print;
    print.up = map.frame.up.value_or(UpAxis::z);
    print.keep_loose = arguments.keep_loose || arguments.min_component;
    PrintMesh made = made_printable(std::move(mesh), print, monitor);
    mesh = std::move(made.mesh);
    written.print = made.report;
  }
  if (has_colors(arguments)) {
    mesh.colors = colors_of(arguments, device, map, options, mesh, written.print.scale, monitor);
  }
  write_mesh(mesh, arguments.output.path, note, map.frame.up);
  const MeshReport report = inspect(mesh);
  written.report.vertices = report.vertices;
  written.report.triangles = report.triangles;
  written.report.open_edges = report.open_edges;
  written.non_manifold_edges = report.non_manifold_edges;
  written.figures = measure(mesh);
  return written;
}

int run_surface(const SurfaceArguments& arguments, Session& session) {
  SurfaceOptions options = checked(arguments.options, arguments.map_options);
  session.check_outputs(
      {arguments.map},
      {output_named("--output", arguments.output, extensions(FileContent::mesh, FileUse::write))});
  if (arguments.up && !stands_upright(arguments.output.path)) {
    throw InputError(
        fmt::format("--up: '{}' keeps the shape's own coordinates; leave --up out, or write .glb "
                    "or .stl, which stand upright",
                    arguments.output.path));
  }
  check_colors(arguments);
  arguments.print.validate();
  const Map read = session.read_map(arguments.map);
  const Device device = session.open_device(arguments.device);
  Map map = scaled(with_knobs(device, read, arguments.map_options, arguments.map),
                   arguments.millimetres, arguments.map, options);
  if (arguments.up) map.frame.up = arguments.up;

  nlohmann::json how = made_with(arguments.map, arguments.map_options, device.info());
  how["resolution"] = options.resolution;
  if (options.draft) how["draft"] = true;
  how.update(print_json(arguments.print));
  if (has_colors(arguments)) {
    how["material"] = value_json(arguments.material);
    how["palette"] = value_json(color_options(arguments, options).palette);
  }
  const bool is_turned = stands_upright(arguments.output.path) && map.frame.up;
  if (is_turned) how["up"] = to_string(*map.frame.up);
  const WrittenSurface written = (streams(arguments) ? stream : collect)(
      arguments, device, map, options, one_line(how), session.monitor());
  const SurfaceReport& report = written.report;
  if (report.triangles == 0) {
    throw Error(
        has_points(device, map, options, session.interrupts.token())
            ? fmt::format("the set of '{}' is too thin for cells of this size; give a --resolution "
                          "higher than {}",
                          arguments.map, options.resolution)
            : fmt::format("the set of '{}' is empty in this box; try a smaller --detail, fewer "
                          "--iterations or another --box",
                          arguments.map));
  }
  const bool closed = report.open_edges == 0 && written.non_manifold_edges == 0;
  const std::size_t components = written.figures.components;
  const std::string stands =
      is_turned ? fmt::format("\nthe shape's {} is up", to_string(*map.frame.up)) : std::string();
  if (report.trusted_share > 0) {
    session.console.detail(to_text(LookupReport{report.nodes, report.trusted_share, 0}));
  }
  session.report_kernels(device);
  const double seconds = session.seconds();
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
       {"made_with", how},
       {"resolution", options.resolution},
       {"points", to_json(report)},
       {"seconds", seconds}});
  return kDone;
}

void describe_surface(Command command, SurfaceArguments& a) {
  command.input("MAP", a.map, "Map file of 'qjulia fit' or 'qjulia shape'")
      .offers_files(readable({FileContent::map}));
  command
      .output(
          "-o,--output", a.output, [&a] { return named_after(a.map, ".ply"); }, "MESH",
          "Mesh to write: " + extension_list(FileContent::mesh, FileUse::write) + "." +
              named_text("map", ".ply"))
      .offers_files(extensions(FileContent::mesh, FileUse::write));
  command.add("--resolution", &a.options.resolution, "INT", "Cells along the box's longest side");
  command.add("--refine", &a.options.refine, "INT",
              "How many points to try, 0 to 20, on each grid edge that the surface crosses, to put "
              "its vertex where the set ends. Default: 2, or 0 with --iterations 1, whose field is "
              "smooth. With 0 vertices are interpolated, which leaves terraces if the field jumps");
  const Option keep = command.flag("--keep-loose", a.keep_loose,
                                   "Keep all connected parts. Default: parts that enclose less "
                                   "than a hundredth of the largest one's volume are left out");
  const Option largest = command
                             .flag("--largest-component", a.largest_component,
                                   "Leave out all but the largest connected part")
                             .excludes({keep});
  command
      .add("--min-component", &a.min_component, "FRACTION",
           "Leave out connected parts with less than this fraction, 0 to 1, of the largest one's "
           "area")
      .excludes({largest, keep})
      .range(0.0, 1.0);
  const Option millimetres =
      command
          .add("--millimetres", &a.millimetres, "LENGTH",
               "Scale the mesh so that the fitted shape's longest side has this length")
          .range(1e-6, 1e9);
  add_print_options(command, a.print, millimetres);
  const Option draft = command.flag(
      "--draft", a.options.draft,
      "Look orbits up in tables instead of computing them: two to three times as fast for maps of "
      "1,000 factors; the surface moves by about a quarter of a cell at most, and typically by "
      "less "
      "than a tenth");
  command
      .flag("--dense", a.options.dense,
            "Run the orbit of every point of the grid to its end: the same mesh, much slower, "
            "without trusting r_in, r_out and bounds")
      .excludes({draft});
  command.choice("--material", a.material,
                 {{to_string(Material::clay), Material::clay},
                  {to_string(Material::iterations), Material::iterations},
                  {to_string(Material::trap), Material::trap}},
                 "What the colours of the vertices show, in .ply, .glb and .obj files: nothing, of "
                 "clay; iterations, how late the orbit of a point is decided; or trap, how close "
                 "two iterates come to the plane X = 0, seen from the origin");
  a.palette_option = add_palette(
      command, a.palette,
      fmt::format("The colours of --material: {}; or 2 to {} of your own with commas between, from "
                  "low to high",
                  fmt::join(palette_names(), ", "), Palette::kMostStops));
  add_up(command, a.up,
         "The shape's axis that points up in .glb and .stl files, which stand upright (.ply, .obj "
         "and .off keep the shape's own coordinates); auto is what the map says");
  add_map_options(command, a.map_options,
                  "Default: the shape's box plus 5 %, grown until the set fits in");
  add_device(command, a.device);
}

}  // namespace

void add_surface(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen, {"surface", "Make a mesh of a map's set", std::string(R"(Examples:
  qjulia surface bunny.qjulia.json -o bunny.ply
  qjulia surface bunny.qjulia.json -o fine.stl --resolution 512 --detail 0.03
  qjulia surface bunny.qjulia.json -o print.stl --height 80 --min-wall 0.8
  qjulia surface bunny.qjulia.json -o light.glb --max-triangles 100000
  qjulia surface bunny.qjulia.json -o wild.ply --detail 0.03 --phase 0.8 0.6 0 0
  qjulia surface bunny.qjulia.json -o colours.glb --material trap --palette ember
The mesh lies in the fitted shape's own coordinates; .glb and .stl stand upright. Only the
undecided shell about the surface is iterated: time grows with its volume, memory with the
mesh and one slab.
)") + kMapOptionsHelp},
              describe_surface, run_surface);
}

}  // namespace qjulia::tools
