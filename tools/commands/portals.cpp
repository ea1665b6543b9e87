/// qjulia portals: copies of a map's set on its own tips.

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "commands/commands.hpp"
#include "describe/files.hpp"
#include "describe/provenance.hpp"
#include "describe/setting_option.hpp"
#include "qjulia/edit/portal_choice.hpp"
#include "qjulia/edit/portal_settings.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/map/map_file.hpp"
#include "qjulia/surface/surface.hpp"

namespace qjulia::tools {
namespace {

struct PortalsArguments {
  std::string map, output;
  TrustedDevice device;
  PortalOptions options;
};

Plan plan_portals(const PortalsArguments& arguments) {
  arguments.options.validate();
  return {{arguments.map}, {{"--output", arguments.output, {".json"}}}};
}

int run_portals(const PortalsArguments& arguments, const Plan& /*plan*/, Session& session) {
  const PortalOptions& options = arguments.options;
  Map map = session.read_map(arguments.map);
  const Device device = session.open_device(arguments.device);
  map.layers.portals = proposed_portals(device, map, options, session.monitor());
  add_job(map, session.job());
  write_map(map, arguments.output);
  session.report_kernels(device);
  const int depth = visible_depth(map.layers.portals);
  const int iterations = std::min(kMostIterations, SurfaceOptions{}.iterations + depth);
  std::string text;
  for (const Portal& portal : map.layers.portals) {
    const Eigen::Vector3d at = map.frame.shape_to_map.to_shape(portal.center);
    text += fmt::format("copy about ({:.3g}, {:.3g}, {:.3g}), {:.3g} of the shape's size\n", at.x(),
                        at.y(), at.z(), 1 / portal.scale);
  }
  if (std::ssize(map.layers.portals) < options.count) {
    session.console.note(
        fmt::format("no more than {} copies fit; a smaller --size leaves more room",
                    map.layers.portals.size()));
  }
  session.console.summary(
      fmt::format("{}a copy needs one iteration more than what it is a copy of: {} for copies on "
                  "copies {} deep\nmap: {}\nnext: qjulia render {} -o picture.png --iterations {}",
                  text, iterations, depth, arguments.output, shell_word(arguments.output),
                  iterations),
      {{"map", arguments.output},
       {"portals", map.layers.portals.size()},
       {"depth", depth},
       {"iterations", iterations}});
  return kDone;
}

void describe_portals(Command command, PortalsArguments& a) {
  command.input("MAP", a.map, "Map file of any kind; portals that it has are replaced")
      .offers_files(readable({base::FileContent::map}));
  command.output(a.output, "MAP", "Map file to write, such as stacked.qjulia.json")
      .offers_files({".json"});
  add_settings(command, portal_settings(), a.options);
  add_device_to_use(command, a.device);
}

}  // namespace

void add_portals(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"portals", "Plant copies of a map's set on its own tips", R"(Examples:
  qjulia portals bunny.qjulia.json -o stack.qjulia.json --count 2
  qjulia render stack.qjulia.json -o stack.png --iterations 9
Portals are balls in which the map moves, turns and enlarges space instead, so that a copy
of the set stands there, with copies on it in turn. Copies are put on protrusions, far apart
from each other. The map file lists them under "portals": move, turn and scale them
there. See docs/guide/portals.md.)"},
              describe_portals, plan_portals, run_portals);
}

}  // namespace qjulia::tools
