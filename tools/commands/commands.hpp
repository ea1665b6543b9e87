#pragma once
/// The list of the program's commands; what each of their files includes.

#include "console/failure.hpp"
#include "describe/options.hpp"
#include "jobs/command.hpp"

// All commands, in the order of the help: `COMMAND(fit)` stands for `add_fit`, which fit.cpp
// defines.
// clang-format off
#define QJULIA_COMMANDS(COMMAND) \
  COMMAND(devices) \
  COMMAND(doctor) \
  COMMAND(fit) \
  COMMAND(shape) \
  COMMAND(paint) \
  COMMAND(portals) \
  COMMAND(surface) \
  COMMAND(render) \
  COMMAND(film) \
  COMMAND(sample) \
  COMMAND(compare) \
  COMMAND(convert) \
  COMMAND(morph) \
  COMMAND(explore) \
  COMMAND(share) \
  COMMAND(run) \
  COMMAND(info) \
  COMMAND(batch) \
  COMMAND(profile)
// clang-format on

namespace qjulia::tools {

#define QJULIA_DECLARE(name) void add_##name(CommandLine& program, ChosenCommand& chosen);
QJULIA_COMMANDS(QJULIA_DECLARE)
#undef QJULIA_DECLARE

}  // namespace qjulia::tools
