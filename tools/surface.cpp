/// qjulia surface: a map in, a mesh out.

#include "qjulia/surface.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "commands.hpp"
#include "exit_code.hpp"
#include "files.hpp"
#include "options.hpp"
#include "qjulia/error.hpp"
#include "qjulia/map_file.hpp"

namespace qjulia::tools {
namespace {

struct Arguments {
  std::string map;
  std::string output;
  std::string device;
  std::vector<double> box;
  MapChanges changes;
  SurfaceOptions options;
};

SurfaceOptions checked_options(const Arguments& arguments) {
  SurfaceOptions options = arguments.options;
  if (const auto& b = arguments.box; !b.empty()) {
    if (!std::ranges::all_of(b, [](double x) { return std::isfinite(x); }) || !(b[0] < b[3]) ||
        !(b[1] < b[4]) || !(b[2] < b[5])) {
      throw InputError(
          "--box must be six finite numbers X0 Y0 Z0 X1 Y1 Z1 with X0 < X1, Y0 < Y1 "
          "and Z0 < Z1");
    }
    options.box = Box{{b[0], b[1], b[2]}, {b[3], b[4], b[5]}};
  }
  options.validate();
  return options;
}

int run(const Arguments& arguments, Session& session) {
  const SurfaceOptions options = checked_options(arguments);
  require_extension(arguments.output, {".ply", ".obj", ".stl", ".off"});
  require_writable(arguments.output);
  const RationalMap map = changed(read_map(arguments.map), arguments.changes, arguments.map);
  const Device device = session.open_device(arguments.device);

  const TriangleMesh mesh = extract_surface(device, map, options, session.watch());
  if (session.interrupts.requested()) {
    session.console.note("interrupted; nothing was written");
    return kInterrupted;
  }
  if (mesh.triangles.empty()) {
    throw Error(
        fmt::format("the set of '{}' is empty in this box; try a smaller --detail, fewer "
                    "--iterations or another --box",
                    arguments.map));
  }
  write_mesh(mesh, arguments.output);
  const MeshReport report = inspect(mesh);
  session.report_kernels(device);
  const double seconds = session.seconds();
  session.console.summary(
      fmt::format(
          "{} vertices, {} triangles, {} component{}, {}; {:.1f} s\nmesh: {}", report.vertices,
          report.triangles, report.components, report.components == 1 ? "" : "s",
          report.closed() ? "closed and manifold" : "not closed", seconds, arguments.output),
      {{"mesh", arguments.output},
       {"vertices", report.vertices},
       {"triangles", report.triangles},
       {"components", report.components},
       {"open_edges", report.open_edges},
       {"non_manifold_edges", report.non_manifold_edges},
       {"closed", report.closed()},
       {"iterations", options.iterations},
       {"resolution", options.resolution},
       {"seconds", seconds}});
  return kDone;
}

}  // namespace

void add_surface(CLI::App& program, ChosenCommand& chosen) {
  auto* command = program.add_subcommand("surface", "Make a mesh of a map's set");
  command->footer(
      "Examples:\n"
      "  qjulia surface bunny.qjulia.json -o bunny.ply\n"
      "  qjulia surface bunny.qjulia.json -o fine.stl --resolution 512 --detail 0.03\n"
      "The mesh lies in the fitted shape's own coordinates. Memory and time grow with the square\n"
      "to the cube of the resolution.");
  auto arguments = std::make_shared<Arguments>();
  Arguments& a = *arguments;
  command->add_option("MAP", a.map, "Map file that 'qjulia fit' wrote")->required()->type_name("");
  command->add_option("-o,--output", a.output, "Mesh to write: .ply, .obj, .stl or .off")
      ->required()
      ->type_name("MESH");
  command->add_option("--resolution", a.options.resolution, "Cells along the box's longest side")
      ->capture_default_str();
  command
      ->add_option("--iterations", a.options.iterations,
                   "Iterations n, 1 to 16: 1 is the fitted shape itself, 6 the set as it stays")
      ->capture_default_str();
  add_map_changes(*command, a.changes);
  command
      ->add_option("--box", a.box,
                   "Part of space to look at, shape units. Default: the shape's box plus 5 %, "
                   "grown until the set fits in")
      ->expected(6)
      ->type_name("X0 Y0 Z0 X1 Y1 Z1");
  add_device(*command, a.device);
  add_verbosity(*command, chosen.verbosity);
  command->callback([arguments, &chosen] {
    chosen.run = [arguments](Session& session) { return run(*arguments, session); };
  });
}

}  // namespace qjulia::tools
