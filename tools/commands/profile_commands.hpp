#pragma once
/// The commands of `qjulia profile`, and what several of them take.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "commands/commands.hpp"
#include "qjulia/profile/profile.hpp"

namespace qjulia::tools {

void add_profile_measure(CommandLine& program, ChosenCommand& chosen);
void add_profile_compare(CommandLine& program, ChosenCommand& chosen);
void add_profile_against(CommandLine& program, ChosenCommand& chosen);
void add_profile_report(CommandLine& program, ChosenCommand& chosen);
void add_profile_scaling(CommandLine& program, ChosenCommand& chosen);
void add_profile_tune(CommandLine& program, ChosenCommand& chosen);
void add_profile_grid(CommandLine& program, ChosenCommand& chosen);
void add_profile_export(CommandLine& program, ChosenCommand& chosen);
void add_profile_import(CommandLine& program, ChosenCommand& chosen);

/// What is measured, and on which device.
struct MeasuredArguments {
  ProfileOptions options;
  std::string map, mesh;  ///< files; empty: made up
  std::string kernels;    ///< patterns with commas between them; empty: not chosen
  std::string jobs;       ///< as well
  TrustedDevice device;
  std::string format;      ///< in place of the table; empty: none
  bool with_host = false;  ///< the report says the host's name
};

/// @throws InputError when both --export and --json say what is printed.
void check_export(const MeasuredArguments& arguments, const Session& session);
/// --export, with these words for formats, and --host-name.
void add_export(Command command, MeasuredArguments& arguments,
                const std::vector<std::string>& formats);

/// The settings of these names, and the options of a device.
void add_measured(Command command, MeasuredArguments& arguments,
                  const std::vector<std::string_view>& settings);
/// The settings of a single measurement, but for counters.
extern const std::vector<std::string_view> kSettingsOfMeasuring;
/// Those of a search for a device's settings.
extern const std::vector<std::string_view> kSettingsOfTuning;

/// MAP and MESH, by their places.
void add_measured_files(Command command, MeasuredArguments& arguments);

/// --kernels.
void add_kernels(Command command, MeasuredArguments& arguments);
/// --jobs.
void add_jobs(Command command, MeasuredArguments& arguments);

/// The files that are read.
std::vector<std::filesystem::path> inputs_of(const MeasuredArguments& arguments);

/// The options with the map and the mesh that are to be measured. @throws InputError
ProfileOptions read_measured(const MeasuredArguments& arguments, Session& session);

}  // namespace qjulia::tools
