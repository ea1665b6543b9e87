#pragma once
/// The subcommands. Each `add_…` describes itself to the parser; when it was the one typed, it sets
/// `chosen` to what runs it.

#include <functional>
#include <string>

#include "command_line.hpp"
#include "session.hpp"

namespace qjulia::tools {

struct ChosenCommand {
  Verbosity verbosity;
  std::string trace;  ///< file; empty: none
  /// Does the work and returns the exit code.
  std::function<int(Session&)> run;
};

void add_devices(CommandLine& program, ChosenCommand& chosen);
void add_doctor(CommandLine& program, ChosenCommand& chosen);
void add_fit(CommandLine& program, ChosenCommand& chosen);
void add_surface(CommandLine& program, ChosenCommand& chosen);
void add_render(CommandLine& program, ChosenCommand& chosen);
void add_sample(CommandLine& program, ChosenCommand& chosen);
void add_compare(CommandLine& program, ChosenCommand& chosen);
void add_convert(CommandLine& program, ChosenCommand& chosen);
void add_info(CommandLine& program, ChosenCommand& chosen);
void add_batch(CommandLine& program, ChosenCommand& chosen);
void add_profile(CommandLine& program, ChosenCommand& chosen);

}  // namespace qjulia::tools
