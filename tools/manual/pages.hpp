#pragma once
/// The program's usage as texts for other programs: manual pages, completions of shells, a page of
/// the documentation.

#include <string>

#include "describe/usage.hpp"

namespace qjulia::manual {

using tools::CommandUsage;
using tools::Completion;
using tools::OptionUsage;
using tools::ProgramUsage;

/// The page of the program itself (qjulia.1), in roff for man.
/// @param date as in "2026-01-31"; empty: none.
/// "qjulia-profile-compare".
std::string page_name(const CommandUsage& command);
std::string program_page(const ProgramUsage& program, const std::string& date);

/// The page of one command, such as qjulia-fit.1.
std::string command_page(const ProgramUsage& program, const CommandUsage& command,
                         const std::string& date);

/// Whether it is a command of a group.
bool is_member(const CommandUsage& command);
/// The command that runs where this one's name stands alone: of a group its usual one.
const CommandUsage& usual_of(const ProgramUsage& program, const CommandUsage& command);

std::string bash_completion(const ProgramUsage& program);
std::string zsh_completion(const ProgramUsage& program);
std::string fish_completion(const ProgramUsage& program);

/// docs/reference/environment.md.
std::string environment_page();

/// docs/reference/command-line.md.
std::string commands_page(const ProgramUsage& program);

/// What completions say of an option: the first clause of its description.
std::string brief(const std::string& description);

}  // namespace qjulia::manual
