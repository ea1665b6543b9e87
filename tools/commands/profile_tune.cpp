/// qjulia profile tune and grid: which settings suit a device.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <nlohmann/json.hpp>

#include "base/output_file.hpp"
#include "base/text.hpp"
#include "commands/profile_commands.hpp"
#include "commands/profile_formats.hpp"
#include "commands/profile_tables.hpp"
#include "console/failure.hpp"
#include "describe/files.hpp"
#include "jobs/run_facts.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/device/tuning_cache.hpp"
#include "qjulia/profile/tune.hpp"

namespace qjulia::tools {
namespace {

struct GridArguments : MeasuredArguments {
  TuneGrid grid;
  std::string csv;
};

/// "lane_width=1,8,16" added to `grid`. @throws InputError
void add_to_grid(const std::string& text, TuneGrid& grid) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) {
    throw InputError(fmt::format(
        "'{}' is not a setting with values; give NAME=A,B,C such as lane_width=1,8,16", text));
  }
  std::vector<int>& values = grid[text.substr(0, equals)];
  for (const std::string& value : base::split(text.substr(equals + 1), ',')) {
    values.push_back(whole_number(value));
  }
}

int run_tune(const MeasuredArguments& arguments, Session& session) {
  check_export(arguments, session);
  session.check_outputs({inputs_of(arguments), {}});
  const ProfileOptions options = read_measured(arguments, session);
  const Device device = session.open_device(arguments.device);
  const std::string file = tuning_file(device.info()).string();
  const TuneReport report = tune(device, options, session.monitor());
  if (report.why_kept.empty()) {
    save_tuning(device.with_tuning(report.precision, report.tuning), report.precision);
  }
  nlohmann::json json = to_json(report);
  json["file"] = file;
  json["made"] = run_facts(session.job(), arguments.with_host);
  session.console.result(arguments.format.empty() ? profile_table(report, file)
                                                  : exported_tuning(json, arguments.format),
                         json);
  if (!report.disturbances.empty()) {
    session.console.warn(fmt::format("the machine was busy: {}; tune on an idle machine",
                                     fmt::join(report.disturbances, "; ")));
  }
  return kDone;
}

int run_grid(const GridArguments& arguments, Session& session) {
  check_export(arguments, session);
  std::vector<base::Output> outputs;
  if (!arguments.csv.empty()) outputs.push_back({"--csv", arguments.csv, {".csv"}});
  session.check_outputs({inputs_of(arguments), outputs});
  const ProfileOptions options = read_measured(arguments, session);
  const Device device = session.open_device(arguments.device);
  const GridReport report = measure_grid(device, options, arguments.grid, session.monitor());
  if (!arguments.csv.empty()) base::write_file(arguments.csv, to_csv(report));
  nlohmann::json json = to_json(report);
  json["made"] = run_facts(session.job(), arguments.with_host);
  session.console.result(
      arguments.format.empty() ? profile_table(report) : exported_tuning(json, arguments.format),
      json);
  return kDone;
}

void describe_tune(Command command, MeasuredArguments& a) {
  add_measured_files(command, a);
  add_export(command, a, kTuningFormats);
  add_measured(command, a, kSettingsOfTuning);
}

void describe_grid(Command command, GridArguments& a) {
  command
      .words(
          "SETTING", [&a](const std::string& text) { add_to_grid(text, a.grid); },
          "NAME=A,B,C: a setting and the values to measure, as in lane_width=1,8,16")
      .required();
  command.file("--map", a.map, "MAP", "Measure with the factors of this map, in its box")
      .offers_files(readable({base::FileContent::map}));
  command.file("--mesh", a.mesh, "MESH", "Mesh that distances are measured to")
      .offers_files(readable({base::FileContent::mesh}));
  command
      .file("--csv", a.csv, "FILE.csv",
            "Also write the figures as a table, a line for each combination and job")
      .offers_files({".csv"});
  add_export(command, a, kTuningFormats);
  add_measured(command, a, kSettingsOfTuning);
}

}  // namespace

void add_profile_tune(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"profile tune", "Find the settings that are fastest on a device, and keep them",
               R"(Example:
  qjulia profile tune             a minute or two, on an idle machine
Finds the lane width, samples per work-item and tile sizes that are fastest here, checks that each
gives the default's results (to 1e-4 of the largest, double 1e-10), and keeps those that are
certainly 3 % faster; on a busy machine the settings stay.
They are kept for the device, its driver and this program in $XDG_CACHE_HOME/qjulia
(~/.cache/qjulia), and every command uses them from then on. Sums are then taken in another
order: maps fitted before and after differ slightly, as they do between machines tuned
differently. QJULIA_TUNING=off in the environment keeps to the defaults, which are the same
everywhere.)"},
              describe_tune, run_tune);
}

void add_profile_grid(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"profile grid", "Measure every combination of a device's settings",
               R"(Examples:
  qjulia profile grid lane_width=1,8,16
  qjulia profile grid lane_width=8,16 panel_block=32,64 --csv all.csv
  qjulia profile grid lane_width=8,16 --export t4 > results.json    as Kernel Tuner writes them
Settings that are not named are the device's own.)"},
              describe_grid, run_grid);
}

}  // namespace qjulia::tools
