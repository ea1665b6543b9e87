/// qjulia profile measure: how fast each kernel runs.

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "base/output_file.hpp"
#include "commands/profile_commands.hpp"
#include "commands/profile_formats.hpp"
#include "commands/profile_tables.hpp"
#include "describe/files.hpp"
#include "describe/provenance.hpp"
#include "describe/setting_option.hpp"
#include "jobs/run_facts.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/profile/profile_settings.hpp"
#include "report/roofline.hpp"

namespace qjulia::tools {
namespace {

struct MeasureArguments : MeasuredArguments {
  std::string baseline, plot, csv;
  double tolerance = 0.2;
};

void check_files(const MeasureArguments& arguments, Session& session) {
  std::vector<std::filesystem::path> inputs = inputs_of(arguments);
  std::vector<base::Output> outputs;
  if (!arguments.baseline.empty()) inputs.emplace_back(arguments.baseline);
  if (!arguments.csv.empty()) outputs.push_back({"--csv", arguments.csv, {".csv"}});
  if (!arguments.plot.empty()) outputs.push_back({"--plot", arguments.plot, {".png"}});
  session.check_outputs({inputs, outputs});
}

int run_measure(const MeasureArguments& arguments, Session& session) {
  if (!(arguments.tolerance >= 0)) throw InputError("--tolerance must not be negative");
  check_export(arguments, session);
  check_files(arguments, session);
  const ProfileOptions options = read_measured(arguments, session);
  nlohmann::json baseline;
  if (!arguments.baseline.empty()) baseline = read_report(arguments.baseline, "--baseline");
  const Device device = session.open_device(arguments.device);
  const ProfileReport report = profile(device, options, session.monitor());
  nlohmann::json json = to_json(report);
  json["made"] = run_facts(session.job(), arguments.with_host);
  if (!arguments.plot.empty()) {
    write_png(report::draw_plot(report::roofline(report)), arguments.plot,
              {{"qjulia", one_line(json)}});
  }
  if (!arguments.csv.empty()) base::write_file(arguments.csv, to_csv(report));
  std::string table = profile_table(report);
  if (report.has_counters) table += '\n' + counter_table(report);
  session.console.result(
      arguments.format.empty() ? table : exported_profile(json, table, arguments.format), json);
  for (const std::string& line : report.left_out) session.console.note("not measured: " + line);
  for (const std::string& line : report.not_counted) session.console.note("not counted: " + line);
  if (const auto signs = report.disturbances(); !signs.empty()) {
    session.console.warn(busy_text(signs));
  }
  if (baseline.is_null()) return kDone;
  const auto slower = regressions(report, baseline, arguments.tolerance);
  for (const std::string& line : slower) session.console.warn("slower: " + line);
  return slower.empty() ? kDone : kFailed;
}

void describe_measure(Command command, MeasureArguments& a) {
  add_measured_files(command, a);
  add_jobs(command, a);
  add_kernels(command, a);
  const auto& counters = setting_named(profile_settings(), "counters", "profiles");
  add_setting(command, counters, counters.place(a.options));
  const Option baseline =
      command
          .file("--baseline", a.baseline, "FILE",
                "An earlier --json report: exit code 1 if a kernel has become slower")
          .offers_files({".json"});
  command
      .add("--tolerance", &a.tolerance, "NUMBER",
           "What counts as slower: 0.2 is 20 % over the baseline's median")
      .needs(baseline);
  command
      .file("--plot", a.plot, "PICTURE.png",
            "Draw a roofline: each kernel's speed over its work per byte of memory, under what the "
            "device can do at most")
      .offers_files({".png"});
  command
      .file("--csv", a.csv, "FILE.csv", "Also write the figures as a table, a line for each kernel")
      .offers_files({".csv"});
  add_export(command, a, kProfileFormats);
  add_measured(command, a, kSettingsOfMeasuring);
}

}  // namespace

void add_profile_measure(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen, {"profile measure", "Measure how fast each kernel runs", R"(Examples:
  qjulia profile measure                           half a minute
  qjulia profile measure --jobs fit --factors 992  why kernels of a fit are as fast as they are;
                                                   a quarter of a minute
  qjulia profile measure --json > before.json
  qjulia profile measure --baseline before.json --tolerance 0.1    exit code 1 if slower
  qjulia profile measure bunny.qjulia.json bunny.obj --time-limit 20
  qjulia profile measure bunny.qjulia.json --kernels 'energy*,gauss*' --iterations 6
  qjulia profile measure --counters --kernels 'gauss*'
  qjulia profile measure --plot roofline.png
  qjulia profile measure --csv kernels.csv
  qjulia profile measure --export pasteable        for an issue
A pair is one factor at one sample for one iterate. The share of the limit compares a
kernel's slots (multiply-adds, multiplications and divisions in its source, one each) with
the measured peak multiply-add rate of the device's widest vectors, or with an m the bytes
that must move with the measured copy; "<" means that orbits may have ended early. On CPUs a
share of multiply-adds counts CPU seconds, which other programs do not change; "CPUs" is the
mean number of processors at work. Each run has its own limit, and the share is the median over
the runs; in parentheses is its 90 % confidence interval (with fewer than five --repeats, the
range of the runs). "not now" means that other programs, or a quota of processors, may have
changed the share: those in parentheses are what was seen. "5 of 8" runs: the others were left
out, because they were disturbed. "cached" means that data stayed in a cache, and "ends early"
that less work may have been done than was counted.
On GPUs the predicted time is what the compiled kernel's instructions and its memory traffic
take at these limits.
Where single kernels are measured (with MAP, --jobs, --kernels or --counters), a line for each
says the sizes of its launches and what limits it: of kernels on x86-64 CPUs a pass of the loop
that takes most of its time, as objdump shows it, and the share of the limit that its
instructions, loads and data allow. With MAP or --kernels '*' this takes one to two minutes;
--jobs and --kernels shorten it, and --time-limit bounds it. Single kernels are indented: their
time is a part of the job's.
Times are from the device's own clock. The spread is the longest run minus the shortest, over the
median. A warning is printed if the machine was not idle.)"},
              describe_measure, run_measure);
}

}  // namespace qjulia::tools
