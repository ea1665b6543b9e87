#pragma once
/// The subcommands. Each `add_…` describes itself to the parser; when it was the one typed, it sets
/// `chosen` to what runs it.

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "session.hpp"

namespace qjulia::tools {

struct ChosenCommand {
  Verbosity verbosity;
  std::string trace;  ///< file; empty: none
  /// Does the work and returns the exit code.
  std::function<int(Session&)> run;
};

void add_devices(CLI::App& program, ChosenCommand& chosen);
void add_fit(CLI::App& program, ChosenCommand& chosen);
void add_surface(CLI::App& program, ChosenCommand& chosen);
void add_render(CLI::App& program, ChosenCommand& chosen);
void add_sample(CLI::App& program, ChosenCommand& chosen);
void add_compare(CLI::App& program, ChosenCommand& chosen);
void add_convert(CLI::App& program, ChosenCommand& chosen);
void add_info(CLI::App& program, ChosenCommand& chosen);
void add_batch(CLI::App& program, ChosenCommand& chosen);
void add_profile(CLI::App& program, ChosenCommand& chosen);

}  // namespace qjulia::tools
