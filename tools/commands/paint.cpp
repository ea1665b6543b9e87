/// qjulia paint: a map whose detail is not the same everywhere.

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "base/file_types.hpp"
#include "base/text.hpp"
#include "commands/commands.hpp"
#include "describe/files.hpp"
#include "describe/provenance.hpp"
#include "describe/setting_option.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/edit/paint_settings.hpp"
#include "qjulia/edit/painting.hpp"
#include "qjulia/map/map_file.hpp"

namespace qjulia::tools {
namespace {

struct PaintArguments {
  std::string map, output, mesh, property, ramp;
  TrustedDevice device;
  bool clear = false;
  PaintOptions options;
};

/// The ramp that a text such as "y=1:0.1" stands for.
PaintRamp ramp_of(const std::string& text) {
  const auto words = base::split(text, ':');
  const std::string& first = words.front();
  if (words.size() == 2 && first.size() > 2 && first[0] >= 'x' && first[0] <= 'z' &&
      first[1] == '=') {
    const double low = base::number_in<double>(first.substr(2)).value_or(-1);
    const double high = base::number_in<double>(words[1]).value_or(-1);
    if (low >= 0 && low <= 1 && high >= 0 && high <= 1) return {first[0] - 'x', low, high};
  }
  throw InputError(fmt::format(
      "'{}' is not AXIS=LOW:HIGH with x, y or z and two shares, such as y=1:0.1", text));
}

Plan plan_paint(const PaintArguments& arguments) {
  const PaintOptions& options = arguments.options;
  if (!arguments.property.empty() && arguments.mesh.empty()) {
    throw InputError("--property: it names a number of a mesh's vertices; give the mesh by --mesh");
  }
  std::vector<std::filesystem::path> inputs{arguments.map};
  if (!arguments.mesh.empty()) inputs.emplace_back(arguments.mesh);
  const bool paints = !options.balls.empty() || !options.blocks.empty() || options.thickness ||
                      options.ramp || !arguments.mesh.empty() ||
                      options.elsewhere != PaintOptions{}.elsewhere;
  if (arguments.clear && paints) {
    throw InputError("--clear only removes paint; leave it out, or the options that paint");
  }
  options.validate();
  return {std::move(inputs), {{"--output", arguments.output, {".json"}}}};
}

int run_paint(const PaintArguments& arguments, const Plan& /*plan*/, Session& session) {
  PaintOptions options = arguments.options;
  Map map = session.read_map(arguments.map);
  map.layers.paint.reset();
  if (!arguments.mesh.empty()) {
    options.mesh = read_painted_mesh(arguments.mesh, arguments.property, session.stop());
  }
  if (arguments.clear) {
    add_job(map, session.job());
    write_map(map, arguments.output);
    session.console.summary(fmt::format("map: {}", arguments.output), {{"map", arguments.output}});
    return kDone;
  }
  const Device device = session.open_device(arguments.device);
  map.layers.paint = painted(device, map, options, session.monitor());
  add_job(map, session.job());
  write_map(map, arguments.output);
  session.report_kernels(device);
  const auto [nx, ny, nz] = map.layers.paint->cells;
  const double cell = map.layers.paint->step / map.frame.shape_to_map.scale;
  session.console.summary(
      fmt::format("{} x {} x {} cells of {:.3g}, {:.1f} s\nmap: {}\nnext: qjulia render {} -o "
                  "picture.png",
                  nx, ny, nz, cell, session.seconds(), arguments.output,
                  shell_word(arguments.output)),
      {{"map", arguments.output},
       {"cells", {nx, ny, nz}},
       {"cell", cell},
       {"seconds", session.seconds()}});
  return kDone;
}

void describe_paint(Command command, PaintArguments& a) {
  command.input("MAP", a.map, "Map file of any kind; paint that it has is replaced")
      .offers_files(readable({base::FileContent::map}));
  command.output(a.output, "MAP", "Map file to write, such as painted.qjulia.json")
      .offers_files({".json"});
  command.repeated_numbers(
      "--ball", "X Y Z RADIUS SHARE", static_cast<int>(PaintOptions::kMostMarks),
      [&a](const std::vector<double>& v) {
        a.options.balls.push_back({{v[0], v[1], v[2]}, v[3], v[4]});
      },
      "A ball, in the mesh's coordinates, whose places have this share of the detail. May be given "
      "again; later ones lie on top");
  command.repeated_numbers(
      "--block", "X0 Y0 Z0 X1 Y1 Z1 SHARE", static_cast<int>(PaintOptions::kMostMarks),
      [&a](const std::vector<double>& v) {
        a.options.blocks.push_back({{{v[0], v[1], v[2]}, {v[3], v[4], v[5]}}, v[6]});
      },
      "The same for a block between two corners, under all balls");
  const auto take_ramp = [&a](const std::string& text) { a.options.ramp = ramp_of(text); };
  command.word("--ramp", "AXIS=LOW:HIGH", take_ramp,
               "Shares that change evenly along an axis, from the shape's low end to its high one, "
               "such as y=1:0.1");
  command
      .file("--mesh", a.mesh, "MESH",
            "The mesh with vertex colours: white places have all of the detail, black ones none. " +
                base::extension_list(base::FileContent::mesh, base::FileUse::paint))
      .offers_files(base::extensions(base::FileContent::mesh, base::FileUse::paint));
  const auto take_property = [&a](const std::string& name) {
    if (name.empty()) throw InputError("the name is empty; name a property of the vertices");
    a.property = name;
  };
  command.word("--property", "NAME", take_property,
               "With --mesh: take shares, 0 to 1, from this property of a .ply's vertices instead");
  add_settings(command, paint_settings(), a.options);
  command.flag("--clear", a.clear, "Takes the map's paint away, and paints nothing");
  add_device_to_use(command, a.device);
}

}  // namespace

void add_paint(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"paint", "Say where a map's surface is wild and where it is smooth", R"(Examples:
  qjulia paint human.qjulia.json -o painted.qjulia.json --thickness 0.15
  qjulia paint bunny.qjulia.json -o half.qjulia.json --ramp x=0:1
  qjulia paint bunny.qjulia.json -o face.qjulia.json --ball -0.85 0.3 0 0.4 0
  qjulia paint bunny.qjulia.json -o colors.qjulia.json --mesh painted.ply
Each place has a share of the map's detail: with 1 nothing changes, with 0 the surface is
the smooth shape (to 1/256 of the detail). Ramp and mesh multiply, blocks and balls take
the place of what is there, and --thickness bounds the result. The paint is a part of the
map, and every command follows it. See docs/guide/painting.md.)"},
              describe_paint, plan_paint, run_paint);
}

}  // namespace qjulia::tools
