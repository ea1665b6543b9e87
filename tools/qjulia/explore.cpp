/// qjulia explore: a page on which a map is played with, drawn by a device of this machine.

#include <fmt/format.h>
#include <spawn.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "base/text.hpp"
#include "commands.hpp"
#include "exit_code.hpp"
#include "explore/server.hpp"
#include "options.hpp"
#include "qjulia/fit.hpp"
#include "qjulia/map_file.hpp"

namespace qjulia::tools {
namespace {

struct ExploreArguments {
  std::string input;
  std::string device;
  bool opens = false;
  explore::ServerOptions options;
};

/// The map to play with: that of the file, or one fitted to it.
RationalMap map_of(const ExploreArguments& arguments, const Device& device, Session& session) {
  if (!is_mesh_file(arguments.input)) {
    return read_map(arguments.input, session.interrupts.token());
  }
  FitResult result =
      fit(device, session.read_mesh(arguments.input), FitOptions{}, session.monitor());
  throw_if_stopped(session.interrupts.token());
  for (const std::string& warning : result.warnings) session.console.warn(warning);
  return std::move(result.map);
}

/// Has the desktop open the page; where there is none, nothing happens.
void open_page(std::string address) {
  std::string program = "xdg-open";
  std::array<char*, 3> words{program.data(), address.data(), nullptr};
  // Signals that this program waits for are blocked in it, and would stay so in the browser.
  sigset_t none;
  ::sigemptyset(&none);
  posix_spawnattr_t attributes;
  if (::posix_spawnattr_init(&attributes) != 0) return;
  ::posix_spawnattr_setsigmask(&attributes, &none);
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
  pid_t child = 0;
  static_cast<void>(
      ::posix_spawnp(&child, program.c_str(), nullptr, &attributes, words.data(), environ));
  ::posix_spawnattr_destroy(&attributes);
}

int run_explore(const ExploreArguments& arguments, Session& session) {
  arguments.options.validate();
  const Device device = session.open_device(arguments.device);
  const RationalMap map = map_of(arguments, device, session);
  const std::string name =
      base::to_utf8(std::filesystem::path(arguments.input).filename().string());
  explore::Server server(device, map, name, arguments.options);
  if (arguments.options.host != explore::ServerOptions{}.host) {
    session.console.warn(
        "others on the network can reach this page, and whoever knows its address can use this "
        "device; nothing is encrypted");
  }
  session.console.result(server.address(), {{"address", server.address()}});
  session.console.note("open this address in a browser; Ctrl-C ends");
  if (arguments.opens) open_page(server.address());
  server.run(session.interrupts.token());
  session.report_kernels(device);
  return kDone;
}

void describe_explore(Command command, ExploreArguments& a) {
  command
      .file("MAP|MESH", a.input,
            "Map file, a page with one, or a mesh (.obj, .off, .ply, .stl), which is fitted first")
      .required()
      .type("");
  command.flag("--open", a.opens, "Open the page in the desktop's browser");
  command.add("--port", &a.options.port, "Port of the page; 0: any that is free")
      .range(0, 65535)
      .type("N");
  command
      .add("--host", &a.options.host,
           "Address of this machine to listen on. Others than the default can be reached by "
           "whoever is "
           "on the network")
      .type("ADDRESS");
  command.flag("--keep-loose", a.options.keep_loose,
               "Draw all connected parts of the set, as 'qjulia render' does with it");
  add_device(command, a.device);
}

}  // namespace

void add_explore(CommandLine& program, ChosenCommand& chosen) {
  const CommandText text{"explore", "Play with a map in a browser",
                         "Examples:\n"
                         "  qjulia explore bunny.qjulia.json --open\n"
                         "  qjulia explore bunny.obj                 fits first, a minute or so\n"
                         "Prints the address of a page with a slider for every option of the map; "
                         "this machine's device\n"
                         "draws. The page is for this machine alone, and its address has a token "
                         "that nobody can guess.\n"
                         "'qjulia share' makes a page for others. See docs/explore.md.",
                         /*can_trace=*/false};
  add_command(program, chosen, text, describe_explore, run_explore);
}

}  // namespace qjulia::tools
