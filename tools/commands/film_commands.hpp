#pragma once
/// The commands of `qjulia film`.

#include "commands/commands.hpp"

namespace qjulia::tools {

void add_film_make(CommandLine& program, ChosenCommand& chosen);
void add_film_sheet(CommandLine& program, ChosenCommand& chosen);
void add_film_scene(CommandLine& program, ChosenCommand& chosen);
void add_film_template(CommandLine& program, ChosenCommand& chosen);

/// SCRIPT.
void add_script(Command command, std::string& file);
/// --seconds, which stretches all keys.
void add_seconds(Command command, double& seconds);

}  // namespace qjulia::tools
