/// qjulia info: what is in a map or mesh file.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "base/file_types.hpp"
#include "base/setting_json.hpp"
#include "check/label_check.hpp"
#include "commands/commands.hpp"
#include "commands/roughness_report.hpp"
#include "console/device_obstacles.hpp"
#include "describe/files.hpp"
#include "describe/job.hpp"
#include "describe/map_options.hpp"
#include "describe/notes.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/device/tuning_cache.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/map/map_file.hpp"
#include "qjulia/mesh/mesh.hpp"
#include "qjulia/mesh/shape.hpp"
#include "qjulia/surface/figures.hpp"

namespace qjulia::tools {
namespace {

/// F_1 at a healthy map's origin is below it.
constexpr double kDeepEnough = -2;

std::string to_text(const Box& box) {
  return fmt::format("box           {:.4g} x {:.4g} x {:.4g}, from ({:.4g}, {:.4g}, {:.4g})",
                     box.size().x(), box.size().y(), box.size().z(), box.low.x(), box.low.y(),
                     box.low.z());
}

std::string to_text(const SurfaceFigures& figures) {
  std::string text = fmt::format("area          {:.6g}\nvolume        {:.6g}\narea / volume {:.6g}",
                                 figures.area, figures.volume, figures.area / figures.volume);
  if (figures.box_sizes >= 3) {
    text += fmt::format("\ndimension     {:.3f} +- {:.3f}, by boxes of {} sizes", figures.dimension,
                        figures.dimension_error, figures.box_sizes);
  }
  return text;
}

/// Text and JSON of one answer.
struct Answer {
  std::string text;
  nlohmann::json json;

  void add(const std::string& line) { text += "\n" + line; }
  /// Adds a line, and its value under `name` for programs.
  void add(const std::string& line, const char* name, nlohmann::json value) {
    add(line);
    json[name] = std::move(value);
  }
};

struct InfoArguments {
  std::string file;
  DeviceChoice device;
  bool check_precision = false, printable = false, roughness = false;
  double nozzle = 0.4;
  std::optional<double> min_wall;  ///< two lines of the nozzle without
};

/// The device, or none where none was asked for by name and there is none: a file can be described
/// without, but for what has to be computed.
std::optional<Device> device_for(const InfoArguments& arguments, Answer& answer) {
  try {
    expect_room_for_drivers();
    auto [device, warning] = with_cached_tuning(Device::choose(arguments.device));
    if (!warning.empty()) answer.add("note          " + warning);
    return device;
  } catch (const NoDeviceError& error) {
    if (!arguments.device.name.empty() || arguments.check_precision || arguments.roughness) throw;
    answer.add(fmt::format("note          some figures are missing: {}", error.what()));
    return {};
  }
}

void describe_interior(const TriangleMesh& mesh, const Device& device, const std::stop_token& stop,
                       Answer& answer) {
  try {
    const Shape shape = make_shape(device, mesh, stop);
    const double inradius = shape.inradius / shape.shape_to_map.scale;
    const Eigen::Vector3d deepest = shape.shape_to_map.to_shape(Eigen::Vector3d::Zero());
    answer.add(fmt::format("inradius      {:.4g}, about ({:.4g}, {:.4g}, {:.4g})", inradius,
                           deepest.x(), deepest.y(), deepest.z()),
               "inradius", inradius);
    answer.json["deepest_point"] = {deepest.x(), deepest.y(), deepest.z()};
  } catch (const InputError& error) {
    answer.add(fmt::format("note          it cannot be fitted: {}", error.what()));
  }
}

/// What to do before this mesh, in millimetres, is printed with walls of at least `least`; empty
/// when nothing.
std::string print_advice(const TriangleMesh& mesh, const MeshReport& report,
                         const WallThickness& walls, double least) {
  if (!report.closed() || report.is_inside_out) {
    return "close its surface first; 'qjulia surface' writes closed meshes";
  }
  if (report.components > 1) {
    return fmt::format(
        "it falls into {} bodies; 'qjulia surface' leaves loose pieces out, and a "
        "smaller --detail makes fewer",
        report.components);
  }
  if (walls.thinnest >= least) return "";
  if (walls.median < least) {
    return fmt::format(
        "half of its walls are thinner than {:.3g}; make it {:.0f} mm long, as 'qjulia surface "
        "--longest' does",
        least, std::ceil(mesh.box().size().maxCoeff() * least / walls.median));
  }
  return fmt::format(
      "{} of its surface has walls thinner than {:.3g}; "
      "'qjulia surface --min-wall {:.3g}' thickens them",
      walls.tenth < least ? "more than a tenth" : "a hundredth or more", least, least);
}

/// What a printer needs: no open edge, one body, walls it can make.
void describe_print(const TriangleMesh& mesh, const MeshReport& report,
                    const InfoArguments& arguments, const std::stop_token& stop, Answer& answer) {
  const WallThickness walls = wall_thickness(mesh, stop);
  // Slicers want two lines a wall.
  const double least = arguments.min_wall.value_or(2 * arguments.nozzle);
  const bool printable = report.closed() && report.components == 1 && !report.is_inside_out;
  const std::string advice = print_advice(mesh, report, walls, least);
  answer.add(
      fmt::format("printing      {}: {} open edges, {} non-manifold edges, {} {}\n"
                  "walls         1 % are under {:.3g}, 10 % under {:.3g}; the median is {:.3g} "
                  "(units of the "
                  "file)\n"
                  "verdict       {} with walls of {:.3g} mm (units taken as millimetres){}{}",
                  printable ? "one closed body" : "not one closed body", report.open_edges,
                  report.non_manifold_edges, report.components,
                  report.components == 1 ? "body" : "bodies", walls.thinnest, walls.tenth,
                  walls.median, advice.empty() ? "ready to print" : "not ready to print", least,
                  advice.empty() ? "" : ": ", advice),
      "printable",
      {{"closed_body", printable},
       {"thinnest_wall", walls.thinnest},
       {"tenth_of_walls_below", walls.tenth},
       {"median_wall", walls.median},
       {"nozzle", arguments.nozzle},
       {"min_wall", least},
       {"ready", advice.empty()},
       {"advice", advice}});
}

/// Measures, or says why that cannot be done: the rest of the answer holds all the same.
template <class Measure>
void measure_or_tell(const char* name, Answer& answer, const Measure& measure) {
  try {
    measure();
  } catch (const InputError& error) {
    std::string words = name;
    std::ranges::replace(words, '_', ' ');
    answer.add(fmt::format("{:<13} not measured: {}", words, error.what()), name, nullptr);
  }
}

Answer mesh_info(const InfoArguments& arguments, const std::stop_token& stop) {
  const auto [mesh, report] = read_and_inspect_mesh(arguments.file, stop);
  const Box box = mesh.box();
  const SurfaceFigures figures = measure(oriented_outward(mesh, stop), stop);
  const UpAxis up = guess_up(mesh);
  Answer answer;
  answer.text = fmt::format(
      "{}: {}, {}\n"
      "vertices      {}\ntriangles     {}\ncomponents    {}\n{}\n{}\n"
      "up            probably {}",
      arguments.file,
      report.points > 0 ? fmt::format("{} points with normals", report.points) : "mesh",
      report.closed() ? "closed and manifold" : "not closed", report.vertices, report.triangles,
      report.components, to_text(box), to_text(figures), to_string(up));
  answer.json = {{"file", arguments.file},
                 {"type", "mesh"},
                 {"vertices", report.vertices},
                 {"triangles", report.triangles},
                 {"components", report.components},
                 {"open_edges", report.open_edges},
                 {"non_manifold_edges", report.non_manifold_edges},
                 {"welded_vertices", report.welded_vertices},
                 {"dropped_triangles", report.dropped_triangles},
                 {"points", report.points},
                 {"bad_polygons", report.bad_polygons},
                 {"duplicate_triangles", report.duplicate_triangles},
                 {"two_sided_triangles", report.two_sided_triangles},
                 {"turned_parts", report.turned_parts},
                 {"closed", report.closed()},
                 {"figures", to_json(figures)},
                 {"box", base::value_json(box)},
                 {"up", to_string(up)},
                 {"warnings", report.warnings()}};
  if (const auto device = device_for(arguments, answer)) {
    describe_interior(mesh, *device, stop, answer);
    if (arguments.roughness) {
      measure_or_tell("area_at_scales", answer, [&, &mesh = mesh] {
        const MeshScales scales = mesh_scales(*device, mesh, 256, {{}, stop});
        answer.add(scales_text(scales), "area_at_scales", to_json(scales));
      });
      measure_or_tell("porosity", answer, [&, &mesh = mesh] {
        const Porosity porous = porosity(*device, mesh, 128, stop);
        answer.add(porosity_text(porous), "porosity", to_json(porous));
      });
    }
  }
  if (arguments.printable) describe_print(mesh, report, arguments, stop, answer);
  for (const std::string& warning : report.warnings()) answer.add("note          " + warning);
  return answer;
}

void describe_member(const char* name, const Quaternion& q, Answer& answer) {
  answer.add(fmt::format("{:<13} ({}, {}, {}, {})", name, q.x, q.y, q.z, q.w), name,
             {q.x, q.y, q.z, q.w});
}

/// A leaf of a kind: its text and its JSON.
template <class Leaf>
std::pair<std::string, nlohmann::json> leaf_of(const Leaf& leaf) {
  if constexpr (std::is_enum_v<Leaf>) {
    return {std::string(word_of(leaf)), word_of(leaf)};
  } else if constexpr (std::is_integral_v<Leaf>) {
    return {fmt::format("{}", leaf), leaf};
  } else if constexpr (std::is_same_v<Leaf, Quaternion>) {
    return {fmt::format("({:.4g}, {:.4g}, {:.4g}, {:.4g})", leaf.x, leaf.y, leaf.z, leaf.w),
            {leaf.x, leaf.y, leaf.z, leaf.w}};
  } else {
    return {fmt::format("{:.4g}", leaf), leaf};
  }
}

std::pair<std::string, nlohmann::json> leaf_of(const Eigen::Vector3d& v) {
  return {fmt::format("({:.4g}, {:.4g}, {:.4g})", v.x(), v.y(), v.z()), {v.x(), v.y(), v.z()}};
}

std::pair<std::string, nlohmann::json> leaf_of(const std::shared_ptr<const DistanceGrid>& grid) {
  const auto& cells = grid->data().cells;
  return {fmt::format("{} x {} x {}", cells[0], cells[1], cells[2]), cells};
}

/// An object of a map file, by its leaves; lengths are map units.
template <class Kind>
void describe_member(const char* name, const Kind& kind, Answer& answer) {
  std::string text;
  nlohmann::json all;
  Kind::leaves(kind, [&](std::string_view leaf_name, const auto& leaf) {
    const std::string key(leaf_name.empty() ? "cells" : leaf_name);
    const auto [words, json] = leaf_of(leaf);
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", key, words);
    all[key] = json;
  });
  answer.add(fmt::format("{:<13} {}", name, text), name, all);
}

/// What the modulus and the versor are made of.
void describe_kind(const Map& map, Answer& answer) {
  answer.json["kind"] = map.dynamics.kind();
  if (!map.dynamics.factors.empty()) {
    const auto roots =
        std::ranges::count_if(map.dynamics.factors, [](const Factor& f) { return f.exponent > 0; });
    const auto poles =
        std::ranges::count_if(map.dynamics.factors, [](const Factor& f) { return f.exponent < 0; });
    answer.add(fmt::format("factors       {}: {} roots, {} poles", map.dynamics.factors.size(),
                           roots, poles));
    answer.json.update(
        {{"factors", map.dynamics.factors.size()}, {"roots", roots}, {"poles", poles}});
  }
  const auto describe = [&](const char* name, const auto& member) {
    if (answer.json.contains(name)) return;  // the modulus and the versor have it in common
    describe_member(name, member, answer);
  };
  std::visit([&](const auto& kind) { kind.members(kind, describe); }, map.dynamics.modulus);
  std::visit([&](const auto& kind) { kind.members(kind, describe); }, map.dynamics.versor);
}

void describe_portals(const Map& map, Answer& answer) {
  if (map.layers.portals.empty()) return;
  nlohmann::json all = nlohmann::json::array();
  for (const Portal& portal : map.layers.portals) {
    const Eigen::Vector3d& c = portal.center;
    answer.add(
        fmt::format("portal        radius {:.4g} about ({:.4g}, {:.4g}, {:.4g}), map units; "
                    "scale {:.4g}, mask {}",
                    portal.radius, c.x(), c.y(), c.z(), portal.scale, word_of(portal.mask)));
    all.push_back({{"center", {c.x(), c.y(), c.z()}},
                   {"radius", portal.radius},
                   {"scale", portal.scale},
                   {"mask", word_of(portal.mask)}});
  }
  answer.json["portals"] = all;
}

void describe_paint(const Map& map, Answer& answer) {
  if (!map.layers.paint) return;
  const auto [nx, ny, nz] = map.layers.paint->cells;
  double sum = 0, least = 1;
  for (const std::uint8_t share : map.layers.paint->shares) {
    const double m = (share + 1.0) / (Paint::kWhole + 1);
    sum += m;
    least = std::min(least, m);
  }
  const double mean = sum / static_cast<double>(map.layers.paint->shares.size());
  answer.add(fmt::format("paint         {} x {} x {} cells of {:.3g}, map units; shares of the "
                         "detail from {:.3g} on, {:.3g} on average",
                         nx, ny, nz, map.layers.paint->step, least, mean),
             "paint",
             {{"cells", {nx, ny, nz}},
              {"step", map.layers.paint->step},
              {"least", least},
              {"mean", mean}});
}

void describe_shape(const Map& map, Answer& answer) {
  if (const auto& detail = map.frame.detail) {
    answer.add(fmt::format("detail        {:.4g} of the shape's diagonal", *detail), "detail",
               *detail);
  }
  if (const auto& diagonal = map.frame.diagonal) {
    answer.add(
        fmt::format("diagonal      {:.4g}, shape units, before the shape was turned", *diagonal),
        "diagonal", *diagonal);
  }
  if (const auto diagonal = map.frame.own_diagonal(); diagonal && map.frame.detail) {
    const double thickness = *map.frame.detail * *diagonal;
    answer.add(fmt::format("shell         {:.4g} thick, shape units", thickness), "shell_thickness",
               thickness);
  }
  if (const auto& r = map.frame.inradius) {
    answer.add(fmt::format("inradius      {:.4g}, shape units", *r), "inradius", *r);
  }
  if (map.frame.box) answer.add(to_text(*map.frame.box), "box", base::value_json(*map.frame.box));
  if (map.frame.up) {
    answer.add(fmt::format("up            {}", to_string(*map.frame.up)), "up",
               to_string(*map.frame.up));
  }
}

/// What has to be computed: radii, and how deep the origin lies.
void describe_orbits(const Map& map, const Device& device, const std::stop_token& stop,
                     Answer& answer) {
  const StopRadii stops = find_stop_radii(device, map, {}, stop);
  const std::vector<Quaternion> origin{{0, 0, 0, map.dynamics.slice}};
  const double depth = Field(device, map).at(origin).front();
  const auto add_radius = [&](const char* label, const char* name, double radius, bool is_known,
                              const char* otherwise) {
    answer.add(label + (is_known ? fmt::format("{:.4g}, map units", radius) : otherwise), name,
               is_known ? nlohmann::json(radius) : nlohmann::json());
  };
  add_radius("r_in          ", "inner_radius", stops.inner, stops.inner > 0,
             "none: no ball is mapped into itself");
  add_radius("r_out         ", "outer_radius", stops.outer, std::isfinite(stops.outer),
             "none: the set is not bounded");
  answer.add(fmt::format("F1 at origin  {:.4g}", depth), "field_at_origin", depth);
  if (!map.dynamics.is_rational()) return;
  std::string warning = unbounded_warning(map);
  if (warning.empty() && depth > kDeepEnough) {
    warning = fmt::format(
        "F1 at the origin is above {}: the iterated set is near dissolving; use a smaller --detail",
        kDeepEnough);
  }
  if (warning.empty()) return;
  answer.add("note          " + warning);
  answer.json["warnings"] = {warning};
}

void describe_precision(const Map& map, const Device& device, const std::stop_token& stop,
                        Answer& answer) {
  const check::LabelCheck check =
      check::compare_precisions(device, map, check::LabelCheck{}.iterations, stop);
  const double share = static_cast<double>(check.different) / static_cast<double>(check.points);
  answer.add(
      fmt::format("precision     {} of {} labels near the surface ({:.3f} %) differ between "
                  "single and double precision at n = {}",
                  check.different, check.points, 100 * share, check.iterations),
      "precision",
      {{"points", check.points}, {"different", check.different}, {"iterations", check.iterations}});
}

/// The command that made the file, as far as its job says so.
void add_command_of(const nlohmann::json& job, const std::string& file, Answer& answer) {
  try {
    const Job made = job_from_json(job, file);
    const std::string text = command_text(made, command_usage(made.command));
    if (text.empty()) return;
    answer.add("made by       " + text, "command", text);
    answer.add(fmt::format("again         qjulia run {}", shell_word(file)));
  } catch (const InputError&) {
    // Another version's.
  }
}

Answer map_info(const InfoArguments& arguments, const Session& session) {
  const Map map = read_map(arguments.file, session.stop());
  const char* formula =
      std::holds_alternative<QuadraticModulus>(map.dynamics.modulus) ? " q² + c" : "";
  Answer answer{fmt::format("{}: {} map{}", arguments.file, map.dynamics.kind(), formula),
                {{"file", arguments.file}, {"type", "map"}}};
  describe_kind(map, answer);
  const std::string degree =
      std::isfinite(map.dynamics.degree())
          ? fmt::format("{:.4g}{}", map.dynamics.degree(),
                        map.dynamics.is_rational() ? " (sum of the exponents)" : "")
          : "none: F grows with the distance";
  answer.add(
      fmt::format("degree        {}\n"
                  "log scale     {:.6g}\n"
                  "level         {:.6g}\n"
                  "slice         {:.4g}",
                  degree, map.dynamics.log_scale, map.dynamics.surface_level, map.dynamics.slice));
  answer.json.update(
      {{"degree", map.dynamics.degree()},
       {"log_scale", map.dynamics.log_scale},
       {"surface_level", map.dynamics.surface_level},
       {"slice", map.dynamics.slice},
       {"phase",
        {map.dynamics.phase.x, map.dynamics.phase.y, map.dynamics.phase.z, map.dynamics.phase.w}},
       {"provenance", map.provenance.json()}});
  describe_portals(map, answer);
  describe_paint(map, answer);
  describe_shape(map, answer);
  try {
    add_command_of(last_job(map, arguments.file), arguments.file, answer);
  } catch (const InputError&) {
    // It says nothing of how it was made.
  }
  if (const auto device = device_for(arguments, answer)) {
    describe_orbits(map, *device, session.stop(), answer);
    if (arguments.check_precision) {
      describe_precision(map, *device, session.stop(), answer);
    }
    if (arguments.roughness) {
      measure_or_tell("roughness", answer, [&] {
        const Roughness rough = roughness(*device, map, {}, {{}, session.stop()});
        answer.add(roughness_text(rough), "roughness", to_json(rough));
      });
    }
  }
  if (session.console.verbose()) answer.add("provenance    " + map.provenance.json().dump(2));
  return answer;
}

void add_making(const nlohmann::json& made, const std::string& file, Answer& answer) {
  answer.add("made with     " + made.dump(), "made_with", made);
  if (made.contains("job")) add_command_of(made["job"], file, answer);
}

/// Whether the file holds a map. @return the same
bool add_held_map(const std::string& file, const std::stop_token& stop, Answer& answer) {
  const bool holds = holds_map(file, stop);
  answer.add(
      holds ? fmt::format("map           it holds its map: qjulia explore {}", shell_word(file))
            : "map           none: it holds no map",
      "holds_map", holds);
  return holds;
}

/// How a file was made, if this program made it and the file says so.
void describe_making(const InfoArguments& arguments, const std::stop_token& stop, Answer& answer) {
  if (!base::can_hold_note(arguments.file)) return;
  try {
    add_making(embedded_note(arguments.file, stop).at("made_with"), arguments.file, answer);
  } catch (const InputError&) {
    // Another program made it.
  }
  if (base::extension_of(arguments.file) == ".glb") add_held_map(arguments.file, stop, answer);
}

/// A picture of ours: what it shows, and how it was made.
Answer picture_info(const InfoArguments& arguments, const Session& session) {
  const nlohmann::json note = embedded_note(arguments.file, session.stop());
  Answer answer{fmt::format("{}: picture, {} x {} pixels", arguments.file, note.at("width").dump(),
                            note.at("height").dump()),
                {{"file", arguments.file}, {"type", "picture"}}};
  answer.json.update(note);
  add_making(note.at("made_with"), arguments.file, answer);
  add_held_map(arguments.file, session.stop(), answer);
  return answer;
}

int run_info(const InfoArguments& arguments, Session& session) {
  const bool mesh = base::has_type(arguments.file, base::FileContent::mesh, base::FileUse::read);
  const bool picture = base::extension_of(arguments.file) == ".png";
  if (arguments.check_precision && (mesh || picture)) {
    throw InputError(
        fmt::format("--check-precision needs a map, and '{}' is not one", arguments.file));
  }
  if (arguments.printable && !mesh) {
    throw InputError(fmt::format("--printable needs a mesh, and '{}' is not one", arguments.file));
  }
  Answer answer = mesh      ? mesh_info(arguments, session.monitor().stop)
                  : picture ? picture_info(arguments, session)
                            : map_info(arguments, session);
  if (mesh) describe_making(arguments, session.monitor().stop, answer);
  session.console.result(answer.text, answer.json);
  return kDone;
}

void describe_info(Command command, InfoArguments& a) {
  command
      .input("FILE", a.file,
             "Map, a page with one, mesh (" +
                 base::extension_list(base::FileContent::mesh, base::FileUse::read) +
                 "), or a .png that qjulia made")
      .offers_files([] {
        return readable({base::FileContent::map, base::FileContent::mesh});
      }());
  command.flag("--check-precision", a.check_precision,
               "Also count the points near a map's surface that are inside in single and outside "
               "in double precision, or the other way round");
  command.flag("--measure-roughness", a.roughness,
               "Also measure how rough it is: area and volume of the map's set, or of the mesh, at "
               "256 cells, a half, a quarter and an eighth of them, with box dimension, and the "
               "porosity. It takes as long as two surfaces");
  const Option printable =
      command.flag("--printable", a.printable,
                   "Also say if a mesh is ready to print: one closed body, with walls that are "
                   "thick enough on all but a hundredth of its surface");
  const Option nozzle = command
                            .add("--nozzle", &a.nozzle, "NUMBER",
                                 "Width of the printer's nozzle, in millimetres; walls must be two "
                                 "lines of this width thick")
                            .range(0.01, 10)
                            .needs(printable);
  command
      .add("--min-wall", &a.min_wall, "LENGTH",
           "The required thickness of walls, in millimetres, instead of two lines of the nozzle")
      .range(1e-6, 1e9)
      .needs(printable)
      .excludes({nozzle});
  add_device(command, a.device);
}

}  // namespace

void add_info(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"info", "Say what is in a map or mesh", R"(Examples:
  qjulia info bunny.obj                    is it closed? how large? how thick inside?
  qjulia info bunny.stl --printable        is it ready to print?
  qjulia info bunny.stl --printable --min-wall 1.2
  qjulia info bunny.qjulia.json            factors, detail, radii, how deep its origin lies
  qjulia info bunny.qjulia.json --measure-roughness
                                             area against scale, dimension, porosity
  qjulia info bunny.qjulia.json --verbose  and how it was made
  qjulia info bunny.png                    the command that drew a picture
Orbits within r_in stay for ever, orbits beyond r_out leave. F1 at the origin should be
below -2: nearer 0 the set dissolves.)",
               /*can_trace=*/false},
              describe_info, run_info);
}

}  // namespace qjulia::tools
