/// The `qjulia` command: reads the command line, runs one subcommand, turns errors into exit codes.

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "commands.hpp"
#include "exit_code.hpp"
#include "failure.hpp"
#include "help_format.hpp"
#include "qjulia/error.hpp"
#include "qjulia/version.hpp"

namespace qjulia::tools {
namespace {

constexpr const char* kDescription =
    "What would a Mandelbrot-like set in the shape of this mesh look like?\n"
    "qjulia fits an iterated quaternion rational map to a triangle mesh. The map is a few\n"
    "kilobytes and has no resolution: make surfaces and pictures of it as fine as you like.";

constexpr const char* kExamples =
    "First steps:\n"
    "  qjulia devices                                  what can compute here\n"
    "  qjulia fit bunny.obj -o bunny.qjulia.json       mesh to map; a minute or so\n"
    "  qjulia render bunny.qjulia.json -o bunny.png    map to picture\n"
    "  qjulia surface bunny.qjulia.json -o bunny.ply   map to mesh, for Blender or a printer\n"
    "  qjulia compare bunny.qjulia.json bunny.obj      how well does it fit?\n"
    "\n"
    "'qjulia COMMAND --help' explains a command.\n"
    "Exit codes: 0 done, 1 failed, 2 bad usage or input, 3 no usable device, 130 interrupted.";

int run(const ChosenCommand& chosen) {
  Session session(chosen.verbosity, chosen.trace);
  try {
    const int code = chosen.run(session);
    session.finish();
    return code;
  } catch (const Interrupted&) {
    session.console.note("interrupted; nothing was written");
    return kInterrupted;
  }
}

}  // namespace
}  // namespace qjulia::tools

int main(int argc, char** argv) {
  using namespace qjulia;
  using namespace qjulia::tools;
  CLI::App program(kDescription, "qjulia");
  program.formatter(std::make_shared<HelpFormat>());  // of subcommands too
  program.footer(kExamples);
  program.set_version_flag("--version", std::string("qjulia ") + version());
  program.require_subcommand(0, 1);
  ChosenCommand chosen;
  for (const auto add : {add_devices, add_fit, add_surface, add_render, add_sample, add_compare,
                         add_convert, add_info, add_batch, add_profile}) {
    add(program, chosen);
  }
  try {
    program.parse(argc, argv);
    if (!chosen.run) {
      fmt::print(stderr, "{}", program.help());
      return kBadInput;
    }
    return run(chosen);
  } catch (const CLI::ParseError& error) {
    return program.exit(error) == 0 ? kDone : kBadInput;
  } catch (const std::exception& error) {
    say(error);
    return exit_code_of(error);
  }
}
