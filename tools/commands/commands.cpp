#include "commands/commands.hpp"

#include <fmt/format.h>

#include "commands/build_facts.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/base/version.hpp"

namespace qjulia::tools {
namespace {

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
    "'qjulia COMMAND --help' explains a command. Where a file's name follows from the input's, -o "
    "may\n"
    "be left out: a new file is then written to the folder where the command runs.\n"
    "Exit codes: ";

std::string exit_codes() {
  std::string text;
  for (const ExitStatus& status : exit_statuses()) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", static_cast<int>(status.code),
                        status.meaning);
  }
  return text + ".";
}

}  // namespace

const char* const kProgramDescription =
    "What would a Mandelbrot-like set in the shape of this mesh look like?\n"
    "qjulia fits an iterated quaternion rational map to a triangle mesh. The map is some\n"
    "hundred kilobytes and has no resolution: make surfaces and pictures as fine as you like.";

void describe(CommandLine& program, ChosenCommand& chosen) {
  program.root().footer(kExamples + exit_codes());
  program.version([] { return fmt::format("qjulia {}\n{}", version(), build_facts()); });
#define QJULIA_ADD(name) add_##name(program, chosen);
  QJULIA_COMMANDS(QJULIA_ADD)
#undef QJULIA_ADD
}

}  // namespace qjulia::tools
