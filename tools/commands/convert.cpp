/// qjulia convert: a map of another program or version in, a map file out, or a formula for another
/// program.

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/file_types.hpp"
#include "base/output_file.hpp"
#include "commands/commands.hpp"
#include "commands/roughness_report.hpp"
#include "describe/files.hpp"
#include "describe/map_options.hpp"
#include "describe/provenance.hpp"
#include "describe/setting_option.hpp"
#include "formula/formula.hpp"
#include "original/original_file.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/fit/fit.hpp"
#include "qjulia/map/map_file.hpp"
#include "qjulia/mesh/mesh.hpp"
#include "qjulia/morph/versor_transfer.hpp"
#include "qjulia/picture/picture_settings.hpp"
#include "qjulia/surface/surface.hpp"

namespace qjulia::tools {
namespace {

struct ConvertArguments {
  std::string input, portals, versor_from;
  OutputName output;
  TrustedDevice device;
  MapOptions map_options;
  std::optional<UpAxis> up;
  std::optional<int> most_factors;
  RoughnessTarget target;
};

bool is_original_file(const std::string& file) {
  return base::has_type(file, base::FileContent::original_map, base::FileUse::read);
}

Map read_any(const std::string& file, const std::stop_token& stop) {
  return is_original_file(file) ? original::read_original(file) : read_map(file, stop);
}

/// Whether a distance field is to become a mesh.
bool is_of_field(const ConvertArguments& arguments) {
  return base::has_type(arguments.input, base::FileContent::sampled_distance, base::FileUse::read);
}

/// A distance field in, a mesh out.
Plan plan_field(const ConvertArguments& arguments) {
  if (!arguments.map_options.given().empty() || arguments.up || !arguments.portals.empty() ||
      !arguments.versor_from.empty() || arguments.most_factors || arguments.target.is_set()) {
    throw InputError("options change maps, and a distance field becomes a mesh: give none");
  }
  return {{arguments.input},
          {output_named("OUT", arguments.output,
                        base::extensions(base::FileContent::mesh, base::FileUse::write))}};
}

int run_field(const ConvertArguments& arguments, Session& session) {
  const TriangleMesh mesh = original::mesh_of(original::read_sampled_distance(arguments.input));
  write_mesh(mesh, arguments.output.path);
  session.console.summary(
      fmt::format("{} triangles\nmesh: {}\nnext: qjulia shape {} -o map.qjulia.json",
                  mesh.triangles.size(), arguments.output.path, shell_word(arguments.output.path)),
      {{"mesh", arguments.output.path}, {"triangles", mesh.triangles.size()}});
  return kDone;
}

/// What a map may become.
std::vector<std::string> map_outputs() {
  auto types = base::extensions(base::FileContent::formula, base::FileUse::write);
  types.insert(types.begin(), ".json");
  return types;
}

/// What a refit gave, for people and for programs.
struct Refit {
  std::string text;
  nlohmann::json json;
};

/// A map of at most so many factors in place of the map, if it has more: a fit to the surface that
/// the map's factors make (n = 1), with the map's detail, slice, phase and steepness.
Refit refit(Map& map, int most_factors, const Device& device, Session& session) {
  const std::size_t before = map.dynamics.factors.size();
  if (before <= static_cast<std::size_t>(most_factors)) return {};
  if (map.layers.paint || !map.layers.portals.empty()) {
    throw InputError(
        "--factors-at-most: the map has portals or painted detail, which its new factors would "
        "not have; fit a map without, and add them to the result");
  }
  const double start = session.seconds();
  Map shape = map;
  shape.layers.steepness = 1;
  shape.dynamics.slice = 0;  // where factors lie, the new ones too
  SurfaceOptions surface;
  surface.iterations = 1;
  surface.resolution = 128;
  MeshSink sink;
  extract_surface(device, shape, surface, sink, session.monitor());
  session.console.note(
      fmt::format("fitting {} factors to the surface of the {} factors, {} triangles", most_factors,
                  before, sink.mesh.triangles.size()));
  FitOptions options;
  options.factors = most_factors;
  options.steepness = map.layers.steepness;
  options.up = map.frame.up;
  // What is fitted is a shape of its own, whose box is larger where the map has been turned.
  const double enlarged = map.frame.diagonal ? sink.mesh.box().diagonal() / *map.frame.diagonal : 1;
  if (map.frame.detail) options.detail = *map.frame.detail / enlarged;
  FitResult result = fit(device, sink.mesh, options, session.monitor());
  if (result.stopped == StopReason::interrupted) throw Interrupted();
  const double iou = result.stages.back().iou, seconds = session.seconds() - start;
  *result.map.frame.detail *= enlarged;
  result.map.frame.diagonal = map.frame.diagonal;
  result.map.dynamics.slice = map.dynamics.slice;
  result.map.dynamics.phase = map.dynamics.phase;
  result.map.provenance = map.provenance;
  map = std::move(result.map);
  const nlohmann::json json = {
      {"factors_before", before}, {"factors", map.dynamics.factors.size()}, {"iou", iou}};
  map.provenance.set("refitted", json);
  Refit told{fmt::format("refitted from {} factors in {:.1f} s: IoU {:.4f} with the surface of all "
                         "of them, n = 1\n",
                         before, seconds, iou),
             json};
  told.json["seconds"] = seconds;
  return told;
}

formula::Program program_of(const std::string& path) {
  const std::string extension = base::extension_of(path);
  if (extension == ".frag") return formula::Program::fragmentarium;
  return extension == ".fract" ? formula::Program::mandelbulber : formula::Program::shadertoy;
}

void write_formula(const Map& map, const Refit& refitted, const Device& device,
                   const ConvertArguments& arguments, Session& session) {
  const std::string& path = arguments.output.path;
  const formula::Reach reach = formula::reach_of(device, map, session.stop());
  base::write_file(path,
                   formula::formula_text(map, reach, program_of(path), name_of(arguments.input)));
  session.console.summary(
      fmt::format("{}{} factors\nformula: {}", refitted.text, map.dynamics.factors.size(), path),
      {{"formula", path}, {"factors", map.dynamics.factors.size()}, {"refit", refitted.json}});
}

/// @throws InputError for options that concern the versor, which the other map's replaces
void expect_own_versor_unused(const ConvertArguments& arguments) {
  if (arguments.most_factors) {
    throw InputError(
        "--factors-at-most: it does not go with --versor-from; convert one map after the other");
  }
  for (const std::string& name : arguments.map_options.given()) {
    if (name.starts_with("--phase") || name.starts_with("--order")) {
      throw InputError(fmt::format(
          "{}: it turns the versor, which --versor-from replaces; turn it on the result", name));
    }
  }
}

Plan plan_convert(const ConvertArguments& arguments) {
  arguments.map_options.knobs.validate();
  arguments.target.validate();
  if (is_of_field(arguments)) return plan_field(arguments);
  if (!arguments.versor_from.empty()) expect_own_versor_unused(arguments);
  std::vector<std::filesystem::path> inputs{arguments.input};
  if (!arguments.portals.empty()) inputs.emplace_back(arguments.portals);
  if (!arguments.versor_from.empty()) inputs.emplace_back(arguments.versor_from);
  return {std::move(inputs), {output_named("OUT", arguments.output, map_outputs())}};
}

int run_convert(const ConvertArguments& arguments, const Plan& /*plan*/, Session& session) {
  if (is_of_field(arguments)) return run_field(arguments, session);
  Map map = read_any(arguments.input, session.stop());
  std::optional<Device> opened;  // a map that stays as it is needs none
  const auto device = [&]() -> const Device& {
    return opened ? *opened : opened.emplace(session.open_device(arguments.device));
  };
  if (!arguments.map_options.given().empty()) {
    map = with_knobs(device(), map, arguments.map_options, arguments.input);
  }
  if (!arguments.portals.empty()) {
    map.layers.portals = original::read_portal_text(arguments.portals, map.frame.shape_to_map);
  }
  if (arguments.up) map.frame.up = arguments.up;
  if (!arguments.versor_from.empty()) {
    map = with_versor_of(device(), map, read_any(arguments.versor_from, session.stop()),
                         kTransferCells, session.monitor());
  }
  Refit refitted;
  if (arguments.most_factors) {
    if (!map.dynamics.is_rational()) {
      throw InputError(
          fmt::format("--factors-at-most: '{}' is a {} map, which has no factors to fit",
                      arguments.input, map.dynamics.kind()));
    }
    if (base::has_type(arguments.output.path, base::FileContent::formula, base::FileUse::write)) {
      Map few = map;
      few.dynamics.factors.resize(std::min<std::size_t>(
          few.dynamics.factors.size(), static_cast<std::size_t>(*arguments.most_factors)));
      formula::expect_formula(few, program_of(arguments.output.path));
    }
    refitted = refit(map, *arguments.most_factors, device(), session);
  }
  ReachedRoughness reached;
  if (arguments.target.is_set()) {
    reached = reach_target(device(), map, arguments.target, nullptr, session);
  }
  if (base::has_type(arguments.output.path, base::FileContent::formula, base::FileUse::write)) {
    formula::expect_formula(map, program_of(arguments.output.path));
    write_formula(map, refitted, device(), arguments, session);
    session.report_kernels(*opened);
    return kDone;
  }
  add_job(map, session.job());
  write_map(map, arguments.output.path);
  if (opened) session.report_kernels(*opened);
  session.console.summary(fmt::format("{}{}{} factors\nmap: {}", refitted.text, reached.text,
                                      map.dynamics.factors.size(), arguments.output.path),
                          {{"map", arguments.output.path},
                           {"factors", map.dynamics.factors.size()},
                           {"refit", refitted.json},
                           {"target", reached.json}});
  return kDone;
}

void describe_convert(Command command, ConvertArguments& a) {
  command
      .input(
          "IN", a.input,
          "Map: .qjulia.json, or a page, picture (.png) or scene (.glb) that holds one; .o3d or "
          ".poly4d of the papers' programs; or .f3d, a distance field of theirs, which becomes a "
          "mesh")
      .offers_files(readable({base::FileContent::map, base::FileContent::original_map,
                              base::FileContent::sampled_distance}));
  const auto named = [&a] {
    return named_after(a.input, is_of_field(a) ? ".ply" : ".qjulia.json");
  };
  auto types = base::extensions(base::FileContent::mesh, base::FileUse::write);
  for (const std::string& type : map_outputs()) types.push_back(type);
  command
      .output("OUT", a.output, named, "",
              "Map file to write, such as bunny.qjulia.json; or the map's formula, .frag "
              "for Fragmentarium, .glsl for Shadertoy and .fract for Mandelbulber 2; of an .f3d a "
              "mesh: " +
                  base::extension_list(base::FileContent::mesh, base::FileUse::write) + "." +
                  named_text("input", ".qjulia.json or .ply"))
      .offers_files(types);
  command
      .file("--portals", a.portals, "TEXT",
            "Portals from a text file of the papers' program, for a shape in its box of side 1 "
            "about the origin; those of the map are replaced")
      .offers_files({".txt"});
  command
      .file("--versor-from", a.versor_from, "MAP",
            "Take the versor, and so the grooves, of this map, made as much larger as the shape's "
            "inradius is. If both maps are of 'fit', the result holds the shape's distances on a "
            "grid, as a map of 'shape' does, since a map has one list of factors")
      .offers_files(readable({base::FileContent::map, base::FileContent::original_map}));
  command
      .add("--factors-at-most", &a.most_factors, "N",
           "If the map has more than N factors, fit N to its own surface: to the shape that its "
           "factors make at n = 1, since the map does not hold the mesh that it was fitted to. It "
           "takes as long as a fit of N factors")
      .range(8, 20000);
  add_setting(command,
              with_help(picture_setting_named("up"),
                        "The shape's axis that points up; auto is what the map says"),
              &a.up);
  add_knobs(command, a.map_options);
  add_settings(command, target_settings(), a.target);
  add_device_to_use(command, a.device);
}

}  // namespace

void add_convert(CommandLine& program, ChosenCommand& chosen) {
  add_command(
      program, chosen,
      {"convert", "Make a map file of another map, or a formula of it", std::string(R"(Examples:
  qjulia convert bunny.o3d bunny.qjulia.json      a map of the original program
  qjulia convert bunny.f3d bunny.ply              a distance field of the papers'
  qjulia convert bunny.poly4d versor.qjulia.json  a polynomial, for 'shape --versor'
  qjulia convert bunny.qjulia.json stack.qjulia.json --portals bunny.txt
  qjulia convert bunny.qjulia.json crust.qjulia.json --drift 0.8 --detail 0.03
  qjulia convert bunny.qjulia.json rough.qjulia.json --target-area 1.5
  qjulia convert bunny.qjulia.json skin.qjulia.json --versor-from skull.qjulia.json
  qjulia convert lying.qjulia.json standing.qjulia.json --up z
  qjulia convert bunny.qjulia.json bunny.frag     a formula for Fragmentarium
  qjulia convert bunny.qjulia.json bunny.glsl     the same for Shadertoy
  qjulia convert bunny.qjulia.json bunny.glsl --factors-at-most 64
  qjulia convert bunny.qjulia.json bunny.fract    the same for Mandelbulber 2
  qjulia convert bunny.png bunny.qjulia.json      the map that a picture holds
With knobs it writes a map in which they are turned: without these options, 'surface' and
'render' make the same of it as of the first map with them. Only maps that 'fit' or the
papers' programs made, without portals and paint, have formulas: see docs/guide/formulas.md.
)") + kMapOptionsHelp,
       /*can_trace=*/false},
      describe_convert, plan_convert, run_convert);
}

}  // namespace qjulia::tools
