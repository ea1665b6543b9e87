/// The `qjulia` command: reads the command line, runs one subcommand, turns errors into exit codes.

#include <stdlib.h>

#include <filesystem>

#include "commands/commands.hpp"
#include "console/failure.hpp"
#include "console/interrupts.hpp"
#include "console/process_memory.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::tools {
namespace {

/// Called before any library's constructor, which shared objects cannot have.
[[gnu::section(".preinit_array"), gnu::used]] void (*const kSeesHangup)() = &see_hangup;

/// The XDG Base Directory Specification says that a relative path is to be ignored. Drivers would
/// make their folders under whatever folder the command was started in.
void ignore_relative_cache() {
  const char* cache = ::getenv("XDG_CACHE_HOME");
  if (cache != nullptr && !std::filesystem::path(cache).is_absolute()) ::unsetenv("XDG_CACHE_HOME");
}

int run_command(const ChosenCommand& chosen) {
  Session session(chosen.verbosity, chosen.trace, chosen.profile);
  session.begin(chosen.job);
  try {
    const int code = run_planned(chosen, session);
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
    CommandLine program(kProgramDescription, "qjulia");
    ChosenCommand chosen;
    describe(program, chosen);
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
