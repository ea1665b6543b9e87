#pragma once
/// The commands of the program; what each of their files includes.

#include "console/failure.hpp"
#include "describe/options.hpp"
#include "jobs/command.hpp"

namespace qjulia::tools {

void add_devices(CommandLine& program, ChosenCommand& chosen);
void add_doctor(CommandLine& program, ChosenCommand& chosen);
void add_fit(CommandLine& program, ChosenCommand& chosen);
void add_shape(CommandLine& program, ChosenCommand& chosen);
void add_paint(CommandLine& program, ChosenCommand& chosen);
void add_portals(CommandLine& program, ChosenCommand& chosen);
void add_surface(CommandLine& program, ChosenCommand& chosen);
void add_render(CommandLine& program, ChosenCommand& chosen);
void add_film(CommandLine& program, ChosenCommand& chosen);
void add_sample(CommandLine& program, ChosenCommand& chosen);
void add_compare(CommandLine& program, ChosenCommand& chosen);
void add_convert(CommandLine& program, ChosenCommand& chosen);
void add_explore(CommandLine& program, ChosenCommand& chosen);
void add_share(CommandLine& program, ChosenCommand& chosen);
void add_run(CommandLine& program, ChosenCommand& chosen);
void add_info(CommandLine& program, ChosenCommand& chosen);
void add_batch(CommandLine& program, ChosenCommand& chosen);
void add_profile(CommandLine& program, ChosenCommand& chosen);

}  // namespace qjulia::tools
