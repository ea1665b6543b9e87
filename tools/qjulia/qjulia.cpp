/// The `qjulia` command: reads the command line, runs one subcommand, turns errors into exit codes.

#include <stdlib.h>

#include <filesystem>

#include "commands.hpp"
#include "failure.hpp"
#include "process_memory.hpp"
#include "qjulia/error.hpp"
#include "qjulia/version.hpp"

namespace qjulia::tools {
namespace {

constexpr const char* kDescription =
    "What would a Mandelbrot-like set in the shape of this mesh look like?\n"
    "qjulia fits an iterated quaternion rational map to a triangle mesh. The map is some\n"
    "hundred kilobytes and has no resolution: make surfaces and pictures as fine as you like.";

constexpr const char* kExamples =
    "First steps:\n"
    "  qjulia devices                                  what can compute here\n"
    "  qjulia doctor                                   does it compute what it should?\n"
    "  qjulia fit bunny.obj -o bunny.qjulia.json       mesh to map; a minute or so\n"
    "  qjulia shape bunny.obj -o exact.qjulia.json     the same in seconds, larger and exact\n"
    "  qjulia render bunny.qjulia.json -o bunny.png    map to picture\n"
    "  qjulia surface bunny.qjulia.json -o bunny.ply   map to mesh, for Blender or a printer\n"
    "  qjulia share bunny.qjulia.json -o bunny.html    map to a page to play with\n"
    "  qjulia compare bunny.qjulia.json bunny.obj      how well does it fit?\n"
    "\n"
    "'qjulia COMMAND --help' explains a command.\n"
    "Exit codes: 0 done, 1 failed, 2 bad usage or input, 3 no usable device, 130 interrupted.";

/// The XDG Base Directory Specification says that a relative path is to be ignored. Drivers would
/// make their folders under whatever folder the command was started in.
void ignore_relative_cache() {
  const char* cache = ::getenv("XDG_CACHE_HOME");
  if (cache != nullptr && !std::filesystem::path(cache).is_absolute()) ::unsetenv("XDG_CACHE_HOME");
}

int run_command(const ChosenCommand& chosen) {
  Session session(chosen.verbosity, chosen.trace);
  try {
    const int code = chosen.run(session);
    session.finish();
    return session.console.is_result_lost() ? std::max<int>(code, kFailed) : code;
  } catch (const Interrupted&) {
    session.console.note("interrupted; " + session.written_so_far);
    return kInterrupted;
  }
}

}  // namespace
}  // namespace qjulia::tools

int main(int argc, char** argv) {
  using namespace qjulia;
  using namespace qjulia::tools;
  keep_freed_memory();
  prepare_standard_streams();
  ignore_relative_cache();
  try {
    CommandLine program(kDescription, "qjulia");
    program.root().footer(kExamples);
    program.version(std::string("qjulia ") + version());
    ChosenCommand chosen;
    for (const auto add : {add_devices, add_doctor, add_fit, add_shape, add_paint, add_portals,
                           add_surface, add_render, add_sample, add_compare, add_convert,
                           add_explore, add_share, add_info, add_batch, add_profile}) {
      add(program, chosen);
    }
    if (const auto code = program.parse(argc, argv)) return *code;
    if (!chosen.run) {
      print_error(program.help());
      return kBadInput;
    }
    return run_command(chosen);
  } catch (const std::exception& error) {
    say(error);
    return exit_code_of(error);
  }
}
