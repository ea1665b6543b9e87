/// qjulia info: what is in a map or mesh file.

#include <fmt/format.h>

#include <algorithm>

#include "commands.hpp"
#include "exit_code.hpp"
#include "files.hpp"
#include "map_options.hpp"
#include "options.hpp"
#include "qjulia/map_file.hpp"
#include "qjulia/mesh.hpp"

namespace qjulia::tools {
namespace {

std::string to_text(const Box& box) {
  return fmt::format("box           {:.4g} x {:.4g} x {:.4g}, from ({:.4g}, {:.4g}, {:.4g})",
                     box.size().x(), box.size().y(), box.size().z(), box.low.x(), box.low.y(),
                     box.low.z());
}

void mesh_info(const std::string& file, Session& session) {
  MeshReport report;
  const TriangleMesh mesh = read_mesh(file, &report);
  const Box box = mesh.box();
  std::string text = fmt::format(
      "{}: mesh, {}\n"
      "vertices      {}\ntriangles     {}\ncomponents    {}\n{}",
      file, report.closed() ? "closed and manifold" : "not closed", report.vertices,
      report.triangles, report.components, to_text(box));
  for (const std::string& warning : report.warnings()) text += "\nnote          " + warning;
  session.console.result(text, {{"file", file},
                                {"type", "mesh"},
                                {"vertices", report.vertices},
                                {"triangles", report.triangles},
                                {"components", report.components},
                                {"open_edges", report.open_edges},
                                {"non_manifold_edges", report.non_manifold_edges},
                                {"welded_vertices", report.welded_vertices},
                                {"dropped_triangles", report.dropped_triangles},
                                {"closed", report.closed()},
                                {"box", to_json(box)},
                                {"warnings", report.warnings()}});
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

int run(const std::string& file, Session& session) {
  is_mesh_file(file) ? mesh_info(file, session) : map_info(file, session);
  return kDone;
}

}  // namespace

void add_info(CLI::App& program, ChosenCommand& chosen) {
  auto* command = program.add_subcommand("info", "Say what is in a map or mesh");
  command->footer(
      "Examples:\n"
      "  qjulia info bunny.obj                    is it closed? how large?\n"
      "  qjulia info bunny.qjulia.json            factors, detail, how thick is the shell\n"
      "  qjulia info bunny.qjulia.json --verbose  and how it was made");
  auto file = std::make_shared<std::string>();
  command->add_option("FILE", *file, "Map, or mesh (.obj, .off, .ply, .stl)")
      ->required()
      ->type_name("");
  add_verbosity(*command, chosen.verbosity);
  command->callback(
      [file, &chosen] { chosen.run = [file](Session& session) { return run(*file, session); }; });
}

}  // namespace qjulia::tools
