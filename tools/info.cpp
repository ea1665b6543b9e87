/// qjulia info: what is in a map or mesh file.

#include <fmt/format.h>

#include <algorithm>

#include "commands.hpp"
#include "exit_code.hpp"
#include "files.hpp"
#include "map_options.hpp"
#include "options.hpp"
#include "qjulia/error.hpp"
#include "qjulia/figures.hpp"
#include "qjulia/map_file.hpp"
#include "qjulia/mesh.hpp"

namespace qjulia::tools {
namespace {

std::string to_text(const Box& box) {
  return fmt::format("box           {:.4g} x {:.4g} x {:.4g}, from ({:.4g}, {:.4g}, {:.4g})",
                     box.size().x(), box.size().y(), box.size().z(), box.low.x(), box.low.y(),
                     box.low.z());
}

struct Arguments {
  std::string file;
  std::string device;
  bool printable = false;
};

std::string to_text(const SurfaceFigures& figures) {
  std::string text = fmt::format("area          {:.6g}\nvolume        {:.6g}\narea / volume {:.6g}",
                                 figures.area, figures.volume, figures.area / figures.volume);
  if (figures.box_sizes >= 3) {
    text += fmt::format("\ndimension     {:.3f} +- {:.3f}, by boxes of {} sizes", figures.dimension,
                        figures.dimension_error, figures.box_sizes);
  }
  return text;
}

/// What a printer needs: no open edge, one body, walls it can make.
std::string print_report(const TriangleMesh& mesh, const MeshReport& report, const Device& device,
                         nlohmann::json& json) {
  const WallThickness walls = wall_thickness(device, mesh);
  const bool printable = report.closed() && report.components == 1 && !report.is_inside_out;
  json["printable"] = {{"closed_body", printable},
                       {"thinnest_wall", walls.thinnest},
                       {"tenth_of_walls_below", walls.tenth},
                       {"median_wall", walls.median}};
  return fmt::format(
      "\nprinting      {}: {} open edges, {} non-manifold edges, {} bodies\n"
      "walls         1 % thinner than {:.3g}, 10 % than {:.3g}, half than {:.3g} (units of the "
      "file)",
      printable ? "one closed body" : "not one closed body", report.open_edges,
      report.non_manifold_edges, report.components, walls.thinnest, walls.tenth, walls.median);
}

void mesh_info(const Arguments& arguments, Session& session) {
  MeshReport report;
  const TriangleMesh mesh = read_mesh(arguments.file, &report);
  const Box box = mesh.box();
  const SurfaceFigures figures = measure(mesh);
  std::string text = fmt::format(
      "{}: mesh, {}\n"
      "vertices      {}\ntriangles     {}\ncomponents    {}\n{}\n{}",
      arguments.file, report.closed() ? "closed and manifold" : "not closed", report.vertices,
      report.triangles, report.components, to_text(box), to_text(figures));
  nlohmann::json json = {{"file", arguments.file},
                         {"type", "mesh"},
                         {"vertices", report.vertices},
                         {"triangles", report.triangles},
                         {"components", report.components},
                         {"open_edges", report.open_edges},
                         {"non_manifold_edges", report.non_manifold_edges},
                         {"welded_vertices", report.welded_vertices},
                         {"dropped_triangles", report.dropped_triangles},
                         {"closed", report.closed()},
                         {"figures", to_json(figures)},
                         {"box", to_json(box)},
                         {"warnings", report.warnings()}};
  if (arguments.printable) {
    text += print_report(mesh, report, session.open_device(arguments.device), json);
  }
  for (const std::string& warning : report.warnings()) text += "\nnote          " + warning;
  session.console.result(text, json);
}

void map_info(const std::string& file, Session& session) {
  const RationalMap map = read_map(file);
  const auto roots =
      std::ranges::count_if(map.factors, [](const Factor& f) { return f.exponent > 0; });
  const auto poles =
      std::ranges::count_if(map.factors, [](const Factor& f) { return f.exponent < 0; });
  std::string text = fmt::format(
      "{}: rational map\n"
      "factors       {}: {} roots, {} poles\n"
      "degree        {:.4g} (sum of the exponents)\n"
      "log scale     {:.6g}\n"
      "level         {:.6g}\n"
      "slice         {:.4g}",
      file, map.factors.size(), roots, poles, map.degree(), map.log_scale, map.surface_level,
      map.slice);
  nlohmann::json json = {{"file", file},
                         {"type", "map"},
                         {"factors", map.factors.size()},
                         {"roots", roots},
                         {"poles", poles},
                         {"degree", map.degree()},
                         {"log_scale", map.log_scale},
                         {"surface_level", map.surface_level},
                         {"slice", map.slice},
                         {"phase", {map.phase.x, map.phase.y, map.phase.z, map.phase.w}},
                         {"provenance", map.provenance}};
  if (map.detail) {
    text += fmt::format("\ndetail        {:.4g} of the box's diagonal", *map.detail);
    json["detail"] = *map.detail;
  }
  if (map.detail && map.box) {
    const double thickness = *map.detail * map.box->diagonal();
    text += fmt::format("\nshell         {:.4g} thick, shape units", thickness);
    json["shell_thickness"] = thickness;
  }
  if (map.inradius) {
    text += fmt::format("\ninradius      {:.4g}, shape units", *map.inradius);
    json["inradius"] = *map.inradius;
  }
  if (map.box) {
    text += "\n" + to_text(*map.box);
    json["box"] = to_json(*map.box);
  }
  if (session.console.verbose()) text += "\nprovenance    " + map.provenance.dump(2);
  session.console.result(text, json);
}

int run(const Arguments& arguments, Session& session) {
  const bool is_mesh = is_mesh_file(arguments.file);
  if (arguments.printable && !is_mesh) {
    throw InputError(fmt::format("--printable is for meshes, and '{}' is not one", arguments.file));
  }
  is_mesh ? mesh_info(arguments, session) : map_info(arguments.file, session);
  return kDone;
}

}  // namespace

void add_info(CLI::App& program, ChosenCommand& chosen) {
  auto* command = program.add_subcommand("info", "Say what is in a map or mesh");
  command->footer(
      "Examples:\n"
      "  qjulia info bunny.obj                    is it closed? how large?\n"
      "  qjulia info bunny.stl --printable        and how thick are its walls?\n"
      "  qjulia info bunny.qjulia.json            factors, detail, how thick is the shell\n"
      "  qjulia info bunny.qjulia.json --verbose  and how it was made");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("FILE", arguments->file, "Map, or mesh (.obj, .off, .ply, .stl)")
      ->required()
      ->type_name("");
  command->add_flag("--printable", arguments->printable,
                    "Also whether a mesh is one closed body, and how thick its walls are");
  add_device(*command, arguments->device);
  add_verbosity(*command, chosen.verbosity);
  command->callback([arguments, &chosen] {
    chosen.run = [arguments](Session& session) { return run(*arguments, session); };
  });
}

}  // namespace qjulia::tools
