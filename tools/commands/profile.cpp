/// qjulia profile: how fast the kernels run, against the device's own limits.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "base/text.hpp"
#include "commands/profile_commands.hpp"
#include "describe/files.hpp"
#include "describe/setting_option.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/profile/profile_settings.hpp"

namespace qjulia::tools {

const std::vector<std::string_view> kSettingsOfMeasuring = {
    "sample_points", "factors",    "repeats",    "seed",
    "lane_width",    "iterations", "time_limit", "precision"};
const std::vector<std::string_view> kSettingsOfTuning = [] {
  std::vector<std::string_view> names;
  for (const Setting& setting : tune_settings()) names.push_back(setting.name);
  return names;
}();

void add_measured(Command command, MeasuredArguments& arguments,
                  const std::vector<std::string_view>& settings) {
  for (const std::string_view name : settings) {
    const auto& setting = setting_named(profile_settings(), name, "profiles");
    add_setting(command, setting, setting.place(arguments.options));
  }
  add_device_to_use(command, arguments.device);
}

void add_measured_files(Command command, MeasuredArguments& arguments) {
  command
      .file("MAP", arguments.map, "",
            "Map file: measure with its factors, in its box, every kernel that a fit, a surface "
            "and a picture launch")
      .offers_files(readable({base::FileContent::map}));
  command.file("MESH", arguments.mesh, "", "Mesh that distances are measured to")
      .offers_files(readable({base::FileContent::mesh}));
}

void add_kernels(Command command, MeasuredArguments& arguments) {
  command.word(
      "--kernels", "NAMES", [&arguments](const std::string& text) { arguments.kernels = text; },
      "Only jobs and kernels of these names, with * and ?, several with commas: "
      "'energy*,gauss*'. '*' is every kernel, also without a map");
}

void add_jobs(Command command, MeasuredArguments& arguments) {
  command.word(
      "--jobs", "NAMES", [&arguments](const std::string& text) { arguments.jobs = text; },
      "Only these jobs, and a row for each of their kernels: 'fit' for those of a fit with one "
      "iterate (energy, gradient, preconditioner, matrix_diagonal, pursuit), and gauss_newton, "
      "distance, level_set, surface, ray_march; with *, ? and commas, as --kernels");
}

void add_export(Command command, MeasuredArguments& arguments,
                const std::vector<std::string>& formats) {
  command.word(
      "--export", fmt::format("{}", fmt::join(formats, "|")),
      [&arguments, &formats](const std::string& text) {
        if (std::ranges::find(formats, text) == formats.end()) {
          throw InputError(
              fmt::format("'{}' is no format; give {}", text, fmt::join(formats, ", ")));
        }
        arguments.format = text;
      },
      "Print the figures in this format in place of the table");
  command.flag("--host-name", arguments.with_host,
               "Say this host's name in the report, beside program, device, load and date");
}

void check_export(const MeasuredArguments& arguments, const Session& session) {
  if (arguments.format.empty() || !session.console.json()) return;
  throw InputError(fmt::format("--export {} and --json both say what is printed; give one of them",
                               arguments.format));
}

std::vector<std::filesystem::path> inputs_of(const MeasuredArguments& arguments) {
  std::vector<std::filesystem::path> files;
  for (const std::string& file : {arguments.map, arguments.mesh}) {
    if (!file.empty()) files.emplace_back(file);
  }
  return files;
}

ProfileOptions read_measured(const MeasuredArguments& arguments, Session& session) {
  ProfileOptions options = arguments.options;
  if (!arguments.kernels.empty()) options.kernels = base::split(arguments.kernels, ',');
  if (!arguments.jobs.empty()) options.jobs = base::split(arguments.jobs, ',');
  options.validate();
  if (!arguments.map.empty()) options.map = session.read_map(arguments.map);
  if (!arguments.mesh.empty()) options.mesh = session.read_mesh(arguments.mesh);
  return options;
}

void add_profile(CommandLine& program, ChosenCommand& chosen) {
  program.add_group({"profile",
                     "Measure the kernels against the device's limits",
                     R"(Examples:
  qjulia profile measure                                   every kernel of a fit
  qjulia profile measure bunny.qjulia.json                 every kernel, at this map's size
  qjulia profile against old/qjulia                        is this build slower?
  qjulia profile tune                                      once a device; a minute or two)",
                     "",
                     {{"--tune", "tune"},
                      {"--scaling", "scaling"},
                      {"--grid", "grid"},
                      {"--import", "import"},
                      {"--against", "against"}}});
  for (const auto add : {add_profile_measure, add_profile_compare, add_profile_against,
                         add_profile_report, add_profile_scaling, add_profile_tune,
                         add_profile_grid, add_profile_export, add_profile_import}) {
    add(program, chosen);
  }
}

}  // namespace qjulia::tools
