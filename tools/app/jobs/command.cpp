#include "jobs/command.hpp"

#include <fmt/format.h>

#include "qjulia/base/error.hpp"

namespace qjulia::tools {

int run_planned(const ChosenCommand& chosen, Session& session) {
  if (chosen.plan) session.check_outputs(chosen.plan());
  return chosen.run(session);
}

CommandUsage command_usage(const std::string& name) {
  CommandLine program(kProgramDescription, "qjulia");
  ChosenCommand chosen;
  describe(program, chosen);
  for (CommandUsage& usage : program.usage().commands) {
    if (usage.name == name && !usage.is_group()) return usage;
  }
  throw InputError(fmt::format("there is no command '{}'", name));
}

}  // namespace qjulia::tools
