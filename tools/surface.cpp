/// qjulia surface: a map in, a mesh out.

#include "qjulia/surface.hpp"

#include <fmt/format.h>

#include "commands.hpp"
#include "exit_code.hpp"
#include "files.hpp"
#include "map_options.hpp"
#include "options.hpp"
#include "provenance.hpp"
#include "qjulia/error.hpp"
#include "qjulia/map_file.hpp"

namespace qjulia::tools {
namespace {

struct Arguments {
  std::string map;
  std::string output;
  std::string device;
  MapOptions map_options;
  SurfaceOptions options;
};

SurfaceOptions checked_options(const Arguments& arguments) {
  SurfaceOptions options = arguments.options;
  options.iterations = arguments.map_options.iterations;
  options.box = arguments.map_options.box;
  arguments.map_options.knobs.validate();
  options.validate();
  return options;
}

int run(const Arguments& arguments, Session& session) {
  const SurfaceOptions options = checked_options(arguments);
  require_extension(arguments.output, {".ply", ".obj", ".stl", ".off"});
  require_writable(arguments.output);
  const RationalMap read = read_map(arguments.map);
  const Device device = session.open_device(arguments.device);
  const RationalMap map = turned(device, read, arguments.map_options, arguments.map);

  SurfaceReport made;
  const TriangleMesh mesh = extract_surface(device, map, options, session.watch(), &made);
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
       {"made_with", made_with(arguments.map, arguments.map_options, device.info())},
       {"resolution", options.resolution},
       {"points", to_json(made)},
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
      "  qjulia surface bunny.qjulia.json -o crust.ply --drift 0.8 --phase 0.8 0.6 0 0\n"
      "The mesh lies in the fitted shape's own coordinates. Only the undecided shell about\n"
      "the surface is iterated: time grows with its volume, memory with the mesh and one slab.\n" +
      std::string(kMapOptionsHelp));
  auto arguments = std::make_shared<Arguments>();
  Arguments& a = *arguments;
  command->add_option("MAP", a.map, "Map file that 'qjulia fit' wrote")->required()->type_name("");
  command->add_option("-o,--output", a.output, "Mesh to write: .ply, .obj, .stl or .off")
      ->required()
      ->type_name("MESH");
  command->add_option("--resolution", a.options.resolution, "Cells along the box's longest side")
      ->capture_default_str();
  command->add_flag("--dense", a.options.dense,
                    "Iterate every point of the grid: the same mesh, slower");
  add_map_options(*command, a.map_options);
  add_box(*command, a.map_options,
          "Default: the shape's box plus 5 %, grown until the set fits in");
  add_device(*command, a.device);
  add_verbosity(*command, chosen.verbosity);
  command->callback([arguments, &chosen] {
    chosen.run = [arguments](Session& session) { return run(*arguments, session); };
  });
}

}  // namespace qjulia::tools
