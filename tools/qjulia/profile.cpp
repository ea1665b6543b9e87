/// qjulia profile: how fast the kernels run, against the device's own limits.

#include "qjulia/profile.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "base/output_file.hpp"
#include "base/text.hpp"
#include "commands.hpp"
#include "files.hpp"
#include "profile_against.hpp"
#include "profile_compare.hpp"
#include "profile_tables.hpp"
#include "profile_tuning.hpp"
#include "provenance.hpp"
#include "qjulia/error.hpp"
#include "qjulia/scaling.hpp"
#include "report/roofline.hpp"

namespace qjulia::tools {
namespace {

struct ProfileArguments {
  TrustedDevice device;
  std::string baseline, plot, csv, against, export_file, import_file;
  bool tune = false, scaling = false;
  double tolerance = 0.2;
  ProfileOptions options;
  TuneGrid grid;
  bool is_comparison = false;        ///< 'profile compare'
  std::string first, second, third;  ///< map and mesh, or with 'compare' its two files
  std::string kernels;
  std::optional<double> seconds;
  std::optional<double> confidence;
  bool across_drivers = false, across_devices = false;
  std::vector<Option> of_measuring;  ///< options that 'profile compare' has no use for
  std::vector<Option> of_comparing;  ///< and those that only it has
};

int run_scaling(const ProfileArguments& arguments, Session& session) {
  const Device device = session.open_device(arguments.device);
  ScalingOptions options;
  options.precision = arguments.options.precision;
  const ScalingReport report = measure_scaling(device, options, session.monitor());
  if (!arguments.csv.empty()) base::write_file(arguments.csv, to_csv(report));
  session.console.result(profile_table(report), to_json(report));
  return kDone;
}

/// What made the picture, for its text chunk.
std::string made_by(const ProfileReport& report) {
  nlohmann::json json = to_json(report);
  json["program"] = program_name();
  return one_line(json);
}

benchmark::Across across(const ProfileArguments& arguments) {
  if (arguments.across_devices) return benchmark::Across::devices;
  return arguments.across_drivers ? benchmark::Across::drivers : benchmark::Across::builds;
}

int run_compare_profiles(const ProfileArguments& arguments, Session& session) {
  refuse(arguments.of_measuring, "'profile compare' measures nothing");
  if (arguments.third.empty()) {
    throw InputError("'profile compare' needs two files: OLD.json and NEW.json");
  }
  benchmark::ComparisonOptions options;
  options.confidence = arguments.confidence.value_or(options.confidence);
  options.across = across(arguments);
  return compare_profiles(arguments.second, arguments.third, options, session);
}

/// The options as typed, for another program.
int run_against(const ProfileArguments& arguments, Session& session) {
  const ProfileOptions& o = arguments.options;
  AgainstArguments against;
  against.other = arguments.against;
  against.seconds = arguments.seconds.value_or(against.seconds);
  against.comparison.confidence = arguments.confidence.value_or(against.comparison.confidence);
  against.comparison.across = across(arguments);
  against.comparison.validate();
  against.names_kernels = !arguments.kernels.empty();
  std::vector<std::string>& words = against.words;
  for (const std::string& file : {arguments.first, arguments.second}) {
    if (!file.empty()) words.push_back(file);
  }
  const auto add = [&](const char* option, const std::string& value) {
    words.insert(words.end(), {option, value});
  };
  const ProfileOptions usual;
  if (o.samples != usual.samples) add("--samples", std::to_string(o.samples));
  if (o.factors != usual.factors) add("--factors", std::to_string(o.factors));
  add("--repeats", std::to_string(o.repeats));
  if (o.lane_width) add("--width", std::to_string(*o.lane_width));
  if (o.iterations) add("--iterations", std::to_string(*o.iterations));
  if (o.precision != usual.precision) add("--precision", to_string(o.precision));
  if (!arguments.kernels.empty()) add("--kernels", arguments.kernels);
  if (!arguments.device.name.empty()) add("--device", arguments.device.name);
  if (!arguments.device.layout.empty()) add("--layout", arguments.device.layout);
  return profile_against(against, session);
}

/// The options with the map and the mesh that are to be measured.
ProfileOptions measured_options(const ProfileArguments& arguments, Session& session) {
  ProfileOptions options = arguments.options;
  if (!arguments.kernels.empty()) options.kernels = base::split(arguments.kernels, ',');
  if (arguments.seconds) options.seconds = *arguments.seconds;
  options.validate();
  if (!arguments.third.empty())
    throw InputError("give a map and a mesh at most, or 'compare' and two profiles");
  if (!arguments.first.empty()) options.map = session.read_map(arguments.first);
  if (!arguments.second.empty()) options.mesh = session.read_mesh(arguments.second);
  return options;
}

/// Checks the files that are read and written.
void check_files_of_profile(const ProfileArguments& arguments, Session& session) {
  std::vector<std::filesystem::path> inputs;
  std::vector<base::Output> outputs;
  for (const std::string& file :
       {arguments.baseline, arguments.first, arguments.second, arguments.import_file}) {
    if (!file.empty()) inputs.emplace_back(file);
  }
  if (!arguments.csv.empty()) outputs.push_back({"--csv", arguments.csv, {".csv"}});
  if (!arguments.plot.empty()) outputs.push_back({"--plot", arguments.plot, {".png"}});
  if (!arguments.export_file.empty()) {
    outputs.push_back({"--export", arguments.export_file, {".json"}});
  }
  session.check_outputs(inputs, outputs);
}

int run_profile(const ProfileArguments& arguments, Session& session) {
  if (arguments.is_comparison) return run_compare_profiles(arguments, session);
  if (!arguments.of_comparing.empty() && arguments.against.empty()) {
    refuse(arguments.of_comparing, "these options belong to 'profile compare' and --against");
  }
  if (!(arguments.tolerance >= 0)) throw InputError("--tolerance must not be negative");
  if (!arguments.first.empty() &&
      (arguments.scaling || !arguments.export_file.empty() || !arguments.import_file.empty())) {
    throw InputError("--scaling, --export and --import take no map; leave it out");
  }
  check_files_of_profile(arguments, session);
  if (!arguments.against.empty()) return run_against(arguments, session);
  const ProfileOptions options = measured_options(arguments, session);
  nlohmann::json baseline;
  if (!arguments.baseline.empty()) baseline = read_report(arguments.baseline, "--baseline");
  if (arguments.tune) return run_tune(arguments.device, options, session);
  if (!arguments.grid.empty()) {
    return run_grid(arguments.device, options, arguments.grid, arguments.csv, session);
  }
  if (!arguments.export_file.empty()) {
    return run_export(arguments.device, arguments.export_file, session);
  }
  if (!arguments.import_file.empty()) {
    return run_import(arguments.device, arguments.import_file, session);
  }
  if (arguments.scaling) return run_scaling(arguments, session);
  const Device device = session.open_device(arguments.device);
  const ProfileReport report = profile(device, options, session.monitor());
  if (!arguments.plot.empty()) {
    write_png(report::draw_plot(report::roofline(report)), arguments.plot,
              {{"qjulia", made_by(report)}});
  }
  if (!arguments.csv.empty()) base::write_file(arguments.csv, to_csv(report));
  std::string table = profile_table(report);
  if (report.has_counters) table += '\n' + counter_table(report);
  session.console.result(table, to_json(report));
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

/// "compare", a map's file, or with --grid one more of its settings.
void take_word(ProfileArguments& a, std::string& target, const std::string& word) {
  if (!a.grid.empty() && word.find('=') != std::string::npos) {
    add_to_grid(word, a.grid);
    return;
  }
  target = word;
}

void describe_comparison(Command command, ProfileArguments& a) {
  command
      .word(
          "MAP", "",
          [&a](const std::string& word) {
            if (word == "compare") {
              a.is_comparison = true;
            } else {
              take_word(a, a.first, word);
            }
          },
          "Map file: measure with its factors, in its box, every kernel that a fit, a surface and "
          "a picture launch. Or 'compare': say which kernels became slower from OLD to NEW, "
          "without measuring")
      .offers({"compare"});
  command
      .word(
          "MESH", "", [&a](const std::string& word) { take_word(a, a.second, word); },
          "Mesh that distances are measured to. With 'compare', OLD: an earlier --json report")
      .offers_files();
  command
      .word(
          "NEW", "", [&a](const std::string& word) { take_word(a, a.third, word); },
          "With 'compare': a later one")
      .offers_files({".json"});
  const Option confidence =
      command
          .add("--confidence", &a.confidence, "NUMBER",
               "With 'compare' and --against: the confidence for all kernels together. With 0.95, "
               "at most one comparison in twenty wrongly calls a kernel slower")
          .default_text("0.95");
  const Option drivers =
      command.flag("--across-drivers", a.across_drivers,
                   "With 'compare' and --against: compare two drivers, or two versions of one, on "
                   "one machine. Driver, platform and the device's name may differ");
  const Option devices =
      command
          .flag("--across-devices", a.across_devices,
                "With 'compare' and --against: compare although device, driver, layout, width, "
                "precision or tuning differ, and say so")
          .excludes({drivers});
  a.of_comparing = {confidence, drivers, devices};
}

void describe_profile(Command command, ProfileArguments& a) {
  const Option tune =
      command.flag("--tune", a.tune,
                   "Find the lane width, samples per work-item and tile sizes that are fastest "
                   "here, check that each gives the default's results (to 1e-4 of the largest, "
                   "double 1e-10), and keep those that are certainly 3 % faster for every command "
                   "to use; on a busy machine the settings stay");
  const Option scaling = command
                             .flag("--scaling", a.scaling,
                                   "Measure how the time and memory of an energy with its gradient "
                                   "grow with samples (25^3 to 193^3) and factors (83 to 1324)")
                             .excludes({tune});
  const Option grid =
      command
          .word(
              "--grid", "NAME=A,B,C", [&a](const std::string& text) { add_to_grid(text, a.grid); },
              "Measure every combination of these settings, others as default; more of them may "
              "follow as words: lane_width=1,8,16 orbit_group=1,64. With --csv as a table")
          .excludes({tune, scaling});
  const Option exported = command
                              .file("--export", a.export_file, "FILE.json",
                                    "Write this device's settings to a file for other machines")
                              .excludes({tune, scaling, grid})
                              .offers_files({".json"});
  const Option imported = command
                              .file("--import", a.import_file, "FILE.json",
                                    "Keep the settings of such a file for this device")
                              .excludes({tune, scaling, grid, exported})
                              .offers_files({".json"});
  const Option against =
      command
          .file("--against", a.against, "PROGRAM",
                "Another build of qjulia, the older one: profile both in turns, each time in a new "
                "process, until every kernel is decided or --seconds (then by default 300) are "
                "over. Exit codes as 'compare'")
          .excludes({tune, scaling, grid, exported, imported});
  a.of_measuring = {tune, scaling, grid, exported, imported, against};
  const auto measures = [&a](const Option& option) { a.of_measuring.push_back(option); };
  measures(
      command.add("--samples", &a.options.samples, "INT", "Sample points").excludes({scaling}));
  measures(command.add("--factors", &a.options.factors, "INT", "Factors of the map")
               .excludes({scaling}));
  measures(command.add("--repeats", &a.options.repeats, "INT", "Timed runs of each kernel")
               .excludes({scaling}));
  measures(command
               .add("--width", &a.options.lane_width, "INT",
                    "Lanes of a work-item: 1, 8 or 16. Default: what suits the device")
               .default_text("")
               .excludes({tune, scaling}));
  measures(
      command
          .add("--iterations", &a.options.iterations, "INT",
               "n of the jobs of several iterates. Default: 4, and 6 for pictures and surfaces")
          .range(2, 16)
          .excludes({tune, scaling, grid}));
  measures(command
               .word(
                   "--kernels", "NAMES", [&a](const std::string& text) { a.kernels = text; },
                   "Only jobs and kernels of these names, with * and ?, several with commas: "
                   "'energy*,gauss*'. '*' is every kernel, also without a map")
               .excludes({tune, scaling, grid}));
  measures(command
               .add("--seconds", &a.seconds, "SECONDS",
                    "Time for the whole run: jobs share what is left of it, and are left out where "
                    "one run does not fit")
               .excludes({tune, scaling, grid}));
  measures(command
               .flag("--counters", a.options.counters,
                     "Also count, on CPUs, cycles, instructions, cache misses, stalled cycles, CPU "
                     "seconds and page faults of each kernel, and show what the driver says of its "
                     "work-groups, memory and registers")
               .excludes({tune, scaling, grid, against}));
  measures(add_precision(command, a.options.precision, "Arithmetic on the device"));
  const Option baseline =
      command
          .file("--baseline", a.baseline, "FILE",
                "An earlier --json report: exit code 1 if a kernel has become slower")
          .excludes({tune, scaling, grid, exported, imported, against})
          .offers_files({".json"});
  measures(baseline);
  measures(command
               .file("--plot", a.plot, "PICTURE.png",
                     "Draw a roofline: each kernel's speed over its work per byte of memory, under "
                     "what the "
                     "device can do at most")
               .excludes({tune, scaling, grid, exported, imported, against})
               .offers_files({".png"}));
  measures(command
               .file("--csv", a.csv, "FILE.csv",
                     "Also write the figures as a table, a line for each kernel, or with --scaling "
                     "for each "
                     "size")
               .excludes({tune, exported, imported, against})
               .offers_files({".csv"}));
  measures(command
               .add("--tolerance", &a.tolerance, "NUMBER",
                    "What counts as slower: 0.2 is 20 % over the baseline's median")
               .needs(baseline));
  for (const Option& option : add_device_to_use(command, a.device)) measures(option);
  describe_comparison(command, a);
}

}  // namespace

void add_profile(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"profile", "Measure the kernels against the device's limits", R"(Examples:
  qjulia profile
  qjulia profile --json > before.json
  qjulia profile --baseline before.json --tolerance 0.1    exit code 1 if slower
  qjulia profile compare before.json after.json            compare all runs, with bounds
  qjulia profile bunny.qjulia.json bunny.obj --seconds 20  every kernel at this map's size
  qjulia profile bunny.qjulia.json --kernels 'energy*,gauss*' --iterations 6
  qjulia profile --against old/qjulia --seconds 120        two builds, in turns
  qjulia profile --counters --kernels 'gauss*'
  qjulia profile --plot roofline.png
  qjulia profile --scaling                                 cost against size
  qjulia profile --tune                                    once a device; a minute or two
  qjulia profile --grid lane_width=8,16 panel_block=32,64 --csv all.csv
  qjulia profile --export settings.json                    to send in, or for a twin
  qjulia profile --csv kernels.csv
A pair is one factor at one sample for one iterate. The share of the limit compares a
kernel's slots (multiply-adds, multiplications and divisions in its source, one each) with
the measured peak multiply-add rate of the device's widest vectors, or with an m the bytes
that must move with the measured copy; "<" means that orbits may have ended early. On CPUs a
share of multiply-adds counts CPU seconds, which other programs do not change; "CPUs" is the
mean number of processors at work. Each run has its own limit, and the share is the median over
the runs; in parentheses is its 90 % confidence interval (with fewer than five --repeats, the
range of the runs). "not now" means that the machine is too busy to judge the share, "cached"
that data stayed in a cache, and "ends early" that less work may have been done than was counted.
On GPUs the predicted time is what the compiled kernel's instructions and its memory traffic
take at these limits. Single kernels are indented: their time is a part of the job's. Times
are from the device's own clock. The spread is the longest run minus the shortest, over the
median. A warning is printed if the machine was not idle.
'compare' takes two --json reports. The time of each run is multiplied by the multiply-add
limit measured right after it; on a busy machine, CPU seconds and the limit in a CPU second are
used instead.
A kernel is slower if the lower bound of its slowdown is over 2 %. Exit code 0: no kernel is
slower; 1: some are; 4: undecided, because the machine was busy or runs differ too much.
Tuned settings are kept for the device, its driver and this program in
$XDG_CACHE_HOME/qjulia (~/.cache/qjulia), and every command uses them from then on. Sums
are then taken in another order: maps fitted before and after differ slightly,
as they do between machines tuned differently. QJULIA_TUNING=off in the environment keeps to
the defaults, which are the same everywhere.)"},
              describe_profile, run_profile);
}

}  // namespace qjulia::tools
