/// qjulia profile: how fast the kernels run, against the device's own limits.

#include "qjulia/profile.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <nlohmann/json.hpp>

#include "base/output_file.hpp"
#include "commands.hpp"
#include "profile_compare.hpp"
#include "provenance.hpp"
#include "qjulia/error.hpp"
#include "qjulia/scaling.hpp"
#include "qjulia/tune.hpp"
#include "qjulia/tuning_cache.hpp"
#include "report/roofline.hpp"

namespace qjulia::tools {
namespace {

struct ProfileArguments {
  TrustedDevice device;
  std::string baseline, plot, csv;
  bool tune = false, scaling = false;
  double tolerance = 0.2;
  ProfileOptions options;
  std::string action, before, after;  ///< of 'profile compare'
  std::optional<double> confidence;
  bool across_devices = false;
  std::vector<Option> of_measuring;  ///< options that 'profile compare' has no use for
  std::vector<Option> of_comparing;  ///< and those that only it has
};

std::string optional_number(const std::optional<double>& value, double scale) {
  return value ? fmt::format("{:.4g}", *value * scale) : "-";
}

/// The measured limit in multiply-adds a lane and cycle; empty where lanes are not known.
std::string in_cycles(const ProfileReport& report) {
  const double clock = report.limits.clock_fma_per_second;
  if (clock == 0) return {};
  return fmt::format(" ({:.2f} a lane and cycle at the {} MHz that the device reports)",
                     report.limits.fma_per_second / clock, report.device.clock_mhz);
}

std::string table(const ProfileReport& report) {
  std::string text = fmt::format(
      "settings: {}\n"
      "limits: {:.4g} G multiply-adds/s{}, copy {:.4g} GB/s, launch {:.3g} us\n"
      "kernel        n    samples  factors   median s      min s   spread   Gpairs/s   of limit  "
      "predicted s  measured",
      report.is_tuned ? "tuned for this device" : "the defaults",
      1e-9 * report.limits.fma_per_second, in_cycles(report), 1e-9 * report.limits.bytes_per_second,
      1e6 * report.limits.launch_seconds);
  for (const KernelFigures& f : report.kernels) {
    text += fmt::format(
        "\n{:12} {:2} {:10} {:8} {:10.4g} {:10.4g} {:6.1f} % {:>10} {:>10} {:>12} {:>9}", f.kernel,
        f.iterations, f.samples, f.factors, f.median_seconds, f.min_seconds, 100 * f.spread(),
        optional_number(f.pairs_per_second, 1e-9),
        f.share_of_limit ? fmt::format("{:.1f} %", 100 * *f.share_of_limit) : "-",
        optional_number(f.predicted_seconds, 1),
        f.predicted_seconds ? fmt::format("{:.2f} x", f.median_seconds / *f.predicted_seconds)
                            : "-");
  }
  return text;
}

std::string table(const TuneReport& report, const std::string& file) {
  std::string text =
      fmt::format("{:15} {:>6} {:>11} {:>12}", "setting", "value", "difference", "time (best 1)");
  for (const TuneTrial& t : report.trials) {
    text += fmt::format("\n{:15} {:6} {:11.1e} {:>12} {}", t.setting, t.value, t.difference,
                        t.time_ratio > 0 ? fmt::format("{:.3f}", t.time_ratio) : "-",
                        t.taken ? "taken" : t.refused.substr(0, t.refused.find('\n')));
  }
  text += report.time_ratio < 1
              ? fmt::format("\ntuned: {:.3f} times the time with the defaults", report.time_ratio)
              : "\nthe defaults stay: nothing was faster";
  return text + fmt::format("\nsettings: {}\nkept in: {}", to_json(report.tuning).dump(), file);
}

int run_tune(const ProfileArguments& arguments, Session& session) {
  const Device device = session.open_device(arguments.device);
  const std::string file = tuning_file(device.info()).string();
  const TuneReport report = tune(device, arguments.options, session.monitor());
  save_tuning(device.with_tuning(report.precision, report.tuning), report.precision);
  nlohmann::json json = to_json(report);
  json["file"] = file;
  session.console.result(table(report, file), json);
  return kDone;
}

std::string table(const ScalingReport& report) {
  std::string text =
      "energy with gradient\n n    samples  factors       seconds     Gpairs/s   device MB";
  for (const ScalingPoint& p : report.points) {
    const double pairs = static_cast<double>(p.samples * p.factors) * p.iterations;
    text += fmt::format("\n{:2} {:10} {:8} {:13.5f} {:12.2f} {:11.1f}", p.iterations, p.samples,
                        p.factors, p.seconds, 1e-9 * pairs / p.seconds,
                        1e-6 * static_cast<double>(p.device_bytes));
  }
  for (const ScalingLaw& law : report.laws) {
    text += fmt::format(
        "\nn = {}: seconds grow as samples^{:.3f} factors^{:.3f}; worst deviation: × {:.2f}",
        law.iterations, law.samples_exponent, law.factors_exponent, law.worst_ratio);
  }
  return text;
}

int run_scaling(const ProfileArguments& arguments, Session& session) {
  const Device device = session.open_device(arguments.device);
  ScalingOptions options;
  options.precision = arguments.options.precision;
  const ScalingReport report = measure_scaling(device, options, session.monitor());
  if (!arguments.csv.empty()) base::write_file(arguments.csv, to_csv(report));
  session.console.result(table(report), to_json(report));
  return kDone;
}

/// What made the picture, for its text chunk.
std::string made_by(const ProfileReport& report) {
  nlohmann::json json = to_json(report);
  json["program"] = program_name();
  return one_line(json);
}

/// @throws InputError naming those options that were given.
void refuse(const std::vector<Option>& options, const char* why) {
  std::string names;
  for (const Option& option : options) {
    if (option.given()) names += (names.empty() ? "" : ", ") + option.name();
  }
  if (!names.empty()) throw InputError(fmt::format("{}; leave out {}", why, names));
}

int run_compare_profiles(const ProfileArguments& arguments, Session& session) {
  refuse(arguments.of_measuring, "'profile compare' measures nothing");
  if (arguments.after.empty()) {
    throw InputError("'profile compare' needs two files: OLD.json and NEW.json");
  }
  benchmark::ComparisonOptions options;
  options.confidence = arguments.confidence.value_or(options.confidence);
  options.across_devices = arguments.across_devices;
  return compare_profiles(arguments.before, arguments.after, options, session);
}

int run_profile(const ProfileArguments& arguments, Session& session) {
  if (!arguments.action.empty()) return run_compare_profiles(arguments, session);
  refuse(arguments.of_comparing, "these options belong to 'profile compare'");
  arguments.options.validate();
  if (!(arguments.tolerance >= 0)) throw InputError("--tolerance must not be negative");
  std::vector<std::filesystem::path> inputs;
  std::vector<base::Output> outputs;
  if (!arguments.baseline.empty()) inputs.emplace_back(arguments.baseline);
  if (!arguments.csv.empty()) outputs.push_back({"--csv", arguments.csv, {".csv"}});
  if (!arguments.plot.empty()) outputs.push_back({"--plot", arguments.plot, {".png"}});
  session.check_outputs(inputs, outputs);
  nlohmann::json baseline;
  if (!arguments.baseline.empty()) baseline = read_profile_json(arguments.baseline, "--baseline");
  if (arguments.tune) return run_tune(arguments, session);
  if (arguments.scaling) return run_scaling(arguments, session);
  const Device device = session.open_device(arguments.device);
  const ProfileReport report = profile(device, arguments.options, session.monitor());
  if (!arguments.plot.empty()) {
    write_png(report::draw_plot(report::roofline(report)), arguments.plot,
              {{"qjulia", made_by(report)}});
  }
  if (!arguments.csv.empty()) base::write_file(arguments.csv, to_csv(report));
  session.console.result(table(report), to_json(report));
  const std::vector<std::string> signs = report.disturbances();
  if (!signs.empty()) {
    session.console.warn(
        fmt::format("the machine was not idle, and times are too long: {}; measure again",
                    fmt::join(signs, "; ")));
  }
  if (baseline.is_null()) return kDone;
  const auto slower = regressions(report, baseline, arguments.tolerance);
  for (const std::string& line : slower) session.console.warn("slower: " + line);
  return slower.empty() ? kDone : kFailed;
}

void describe_comparison(Command command, ProfileArguments& a) {
  const Option action =
      command
          .word(
              "ACTION", "",
              [&a](const std::string& word) {
                if (word != "compare") {
                  throw InputError(fmt::format("'{}' is not known; only 'compare' is", word));
                }
                a.action = word;
              },
              "'compare': say which kernels became slower from OLD to NEW, without measuring")
          .offers({"compare"});
  command.file("OLD", a.before, "", "With 'compare': an earlier --json report")
      .needs(action)
      .offers_files({".json"});
  command.file("NEW", a.after, "", "With 'compare': a later one")
      .needs(action)
      .offers_files({".json"});
  a.of_comparing = {
      command
          .add("--confidence", &a.confidence, "NUMBER",
               "With 'compare': the confidence for all kernels together. With 0.95, at most one "
               "comparison in twenty wrongly calls a kernel slower")
          .default_text("0.95"),
      command.flag("--across-devices", a.across_devices,
                   "With 'compare': compare although device, driver, layout, width, precision or "
                   "tuning differ, and say so")};
}

void describe_profile(Command command, ProfileArguments& a) {
  const Option tune =
      command.flag("--tune", a.tune,
                   "Find the lane width, samples per work-item and tile sizes that are fastest "
                   "here, check that each gives the default's results (to 1e-4 of the largest, "
                   "double 1e-10), and keep the best for every command to use");
  const Option scaling = command
                             .flag("--scaling", a.scaling,
                                   "Measure how the time and memory of an energy with its gradient "
                                   "grow with samples (25^3 to 193^3) and factors (83 to 1324)")
                             .excludes({tune});
  a.of_measuring = {tune, scaling};
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
  measures(add_precision(command, a.options.precision, "Arithmetic on the device"));
  const Option baseline =
      command
          .file("--baseline", a.baseline, "FILE",
                "An earlier --json report: exit code 1 if a kernel has become slower")
          .excludes({tune, scaling})
          .offers_files({".json"});
  measures(baseline);
  measures(command
               .file("--plot", a.plot, "PICTURE.png",
                     "Draw a roofline: each kernel's speed over its work per byte of memory, under "
                     "what the "
                     "device can do at most")
               .excludes({tune, scaling})
               .offers_files({".png"}));
  measures(command
               .file("--csv", a.csv, "FILE.csv",
                     "Also write the figures as a table, a line for each kernel, or with --scaling "
                     "for each "
                     "size")
               .excludes({tune})
               .offers_files({".csv"}));
  measures(command
               .add("--tolerance", &a.tolerance, "NUMBER",
                    "What counts as slower: 0.2 is 20 % over the baseline's median")
               .needs(baseline));
  measures(add_device_to_use(command, a.device));
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
  qjulia profile --plot roofline.png
  qjulia profile --scaling                                 cost against size
  qjulia profile --tune                                    once a device; a minute or two
  qjulia profile --csv kernels.csv
A pair is one factor at one sample for one iterate. The share of the limit compares a
kernel's slots (multiply-adds, multiplications and divisions in its source, one each) with
the measured peak multiply-add rate. The predicted time is what the compiled kernel's
instructions, as counted for GPUs, and its memory traffic take at these limits. Rays and
distances end early by design: they have times only. Times are from the device's own
clock. The spread is that of the runs, over their median; a warning says so when the
machine was not idle.
'compare' takes two --json reports. The time of each run is multiplied by the multiply-add
limit measured right after it. A kernel is slower if the lower bound of its slowdown is over
2 %. Exit code 0: no kernel is slower; 1: some are; 3: undecided, because the machine was
busy or runs differ too much.
Tuned settings are kept for the device, its driver and this program in
$XDG_CACHE_HOME/qjulia (~/.cache/qjulia), and every command uses them from then on. Sums
are then taken in another order: maps fitted before and after differ slightly,
as they do between machines tuned differently. QJULIA_TUNING=off in the environment keeps to
the defaults, which are the same everywhere.)"},
              describe_profile, run_profile);
}

}  // namespace qjulia::tools
