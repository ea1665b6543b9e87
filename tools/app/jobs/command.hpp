#pragma once
/// How a command is added to a program: it describes its options to the parser, and when it was the
/// one typed, it sets `chosen` to what runs it.

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "console/failure.hpp"
#include "describe/command_line.hpp"
#include "describe/options.hpp"
#include "jobs/session.hpp"

namespace qjulia::tools {

struct ChosenCommand {
  Job job;  ///< what was typed
  Verbosity verbosity;
  std::string trace;    ///< file; empty: none
  std::string profile;  ///< the same of the command's profile
  /// Checks all that was typed; then the files of `Plan` can be checked. Empty for commands that do
  /// both in `run`.
  std::function<Plan()> plan;
  /// Does the work and returns the exit code. `plan` is to be called first.
  std::function<int(Session&)> run;
};

/// What the program's help and the command's own say of it.
struct CommandText {
  std::string name;
  std::string description;
  std::string footer;
  bool can_trace = true;     ///< takes --trace
  bool can_profile = false;  ///< takes --profile
};

/// Adds a command with the options that all have. @param describe adds its own.
template <class Arguments, class Described>
Command described(CommandLine& program, ChosenCommand& chosen, const CommandText& text,
                  Described (*describe)(Command, Arguments&), Arguments& arguments) {
  const Command command = program.add_command(text.name, text.description);
  command.footer(text.footer);
  describe(command, arguments);
  if (text.can_trace) add_trace(command, chosen.trace);
  if (text.can_profile) add_command_profile(command, chosen.profile);
  add_verbosity(command, chosen.verbosity);
  return command;
}

/// A command that calls `Session::check_outputs` itself, because what it writes depends on more
/// than its arguments: of a fit on several ranks, only the first writes.
/// @param describe adds the options that set what `run` gets, to a command in its final place; what
///   it returns is left.
template <class Arguments, class Described>
void add_command(CommandLine& program, ChosenCommand& chosen, const CommandText& text,
                 Described (*describe)(Command, Arguments&),
                 int (*run)(const Arguments&, Session&)) {
  const auto arguments = std::make_shared<Arguments>();
  const Command command = described(program, chosen, text, describe, *arguments);
  command.on_chosen([arguments, command, run, &chosen] {
    chosen.job = command.job();
    chosen.run = [arguments, run](Session& session) { return run(*arguments, session); };
  });
}

/// A command that makes files, and knows which before it begins.
/// @param plan checks the arguments, and opens neither a device nor an output. Its result is a
///   `Plan`, or derived from it where `run` needs what the check has found.
template <class Arguments, class Described, class Planned>
void add_command(CommandLine& program, ChosenCommand& chosen, const CommandText& text,
                 Described (*describe)(Command, Arguments&), Planned (*plan)(const Arguments&),
                 int (*run)(const Arguments&, const Planned&, Session&)) {
  const auto arguments = std::make_shared<Arguments>();
  const auto planned = std::make_shared<std::optional<Planned>>();
  const Command command = described(program, chosen, text, describe, *arguments);
  command.on_chosen([arguments, planned, command, plan, run, &chosen] {
    chosen.job = command.job();
    chosen.plan = [arguments, planned, plan]() -> Plan {
      const Plan& files = planned->emplace(plan(*arguments));
      return {files.inputs, files.outputs, files.further_inputs};
    };
    chosen.run = [arguments, planned, run](Session& session) {
      return run(*arguments, planned->value(), session);
    };
  });
}

/// Checks what the command reads and writes, and runs it. @return the exit code
int run_planned(const ChosenCommand& chosen, Session& session);

/// What the program's help begins with. The program that links this room defines it.
extern const char* const kProgramDescription;

/// The whole program: its help, version and commands. The program that links this room defines it,
/// since it knows which commands it has.
void describe(CommandLine& program, ChosenCommand& chosen);

/// What the command of this name takes. @throws InputError where there is none.
CommandUsage command_usage(const std::string& name);

}  // namespace qjulia::tools
