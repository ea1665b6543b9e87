/// qjulia share: a map in, a page out on which anybody can play with it.

#include <fmt/format.h>

#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <vector>

#include "base/output_file.hpp"
#include "commands/commands.hpp"
#include "describe/files.hpp"
#include "explore/page.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/map_file.hpp"

namespace qjulia::tools {
namespace {

struct ShareArguments {
  std::string map;
  OutputName output;
  TrustedDevice device;
};

Plan plan_share(const ShareArguments& arguments) {
  return {{arguments.map}, {output_named("--output", arguments.output, {".html"})}};
}

int run_share(const ShareArguments& arguments, const Plan& /*plan*/, Session& session) {
  Map map = read_map(arguments.map, session.stop());
  add_job(map, session.job());
  const Device device = session.open_device(arguments.device);
  const std::string page = explore::shared_page(map, name_of(arguments.map),
                                                explore::page_scene(device, map, session.stop()),
                                                explore::page_outline(device, map, session.stop()));
  session.report_kernels(device);
  base::write_file(arguments.output.path, page);
  session.console.summary(
      fmt::format("page: {}, {} KiB: open it in a browser, mail it, put it on any web space",
                  arguments.output.path, (page.size() + 1023) / 1024),
      {{"page", arguments.output.path}, {"bytes", page.size()}});
  return kDone;
}

void describe_share(Command command, ShareArguments& a) {
  command.input("MAP", a.map, "Map file; or a page, picture (.png) or scene (.glb) that holds one")
      .offers_files(readable({base::FileContent::map}));
  command
      .output(
          "-o,--output", a.output, [&a] { return named_after(a.map, ".html"); }, "PAGE",
          "Page to write: .html." + named_text("map", ".html"))
      .offers_files({".html"});
  add_device_to_use(command, a.device);
}

}  // namespace

void add_share(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"share", "Make a page on which others play with a map", R"(Example:
  qjulia share bunny.qjulia.json -o bunny.html
The page needs nothing else, no network and no qjulia: the viewer's own graphics draw the set
(WebGL 2). A device measures the map over the ranges of its knobs, which takes some seconds, and the
page looks the figures up. The page has a slider for every option of the map that it can draw, names
those that need "qjulia explore", and its address holds all settings, so that a link to it is a
shape. The map is in it: every command that reads maps reads the page too. See docs/guide/explore.md.)",
               /*can_trace=*/false},
              describe_share, plan_share, run_share);
}

}  // namespace qjulia::tools
