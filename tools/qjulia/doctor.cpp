/// qjulia doctor: does a device compute what it should?

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>

#include "base/output_file.hpp"
#include "base/temporary_folder.hpp"
#include "check_process.hpp"
#include "commands.hpp"
#include "doctor_matrix.hpp"
#include "doctor_reports.hpp"
#include "failure.hpp"
#include "files.hpp"
#include "machine_findings.hpp"
#include "provenance.hpp"
#include "qjulia/driver_facts.hpp"
#include "qjulia/error.hpp"
#include "qjulia/self_test.hpp"

namespace qjulia::tools {
namespace {

struct DoctorArguments {
  DeviceChoice device;
  std::optional<int> checks_from;  ///< in a process for the checks: the first of them
  int most_seconds = 600;          ///< for one check, whose compiler may hang
  std::string programs, junit;
  bool is_matrix = false;
  bool is_comparison = false;     ///< 'doctor compare'
  std::string before, after;      ///< with 'compare': its two files
  std::vector<Option> of_checks;  ///< that 'doctor compare' has no use for
};

void add_doctor_options(Command command, DoctorArguments& a) {
  command
      .word(
          "compare", "",
          [&a](const std::string& word) {
            if (word != "compare") {
              throw InputError(fmt::format(
                  "'doctor {}' is not known; give 'compare' and two reports, or options alone",
                  word));
            }
            a.is_comparison = true;
          },
          "Say what changed from report A to report B, without a device")
      .offers({"compare"});
  command
      .word(
          "A", "", [&a](const std::string& word) { a.before = word; },
          "With 'compare': an earlier --json report, of another driver or build perhaps")
      .offers_files({".json"});
  command
      .word(
          "B", "", [&a](const std::string& word) { a.after = word; }, "With 'compare': a later one")
      .offers_files({".json"});
  a.of_checks = {
      command.word(
          "--programs", "NAMES", [&a](const std::string& text) { a.programs = text; },
          "Only programs of these names, with * and ?, several with commas: "
          "'energy.cl,gradient*'"),
      command.flag("--matrix", a.is_matrix,
                   "Check under one setting of PoCL after the other: its methods for work-groups, "
                   "one thread, no specialisation, no optimiser, no cache. Each runs in a process "
                   "and with an empty cache of its own, so that all compile everything"),
      command
          .file("--junit", a.junit, "FILE.xml",
                "Also write the results as JUnit's XML, which CI services show; with --matrix a "
                "suite for each setting")
          .offers_files({".xml"})};
  command
      .add("--checks-from", &a.checks_from, "N",
           "Given by this program to processes that run its checks")
      .range(0, 1000)
      .group("");
  command.add("--seconds-per-check", &a.most_seconds, "S", "For tests of a compiler that hangs")
      .range(1, 86400)
      .group("");
  for (const Option& option : add_device(command, a.device)) a.of_checks.push_back(option);
}

/// Where compilers' logs of programs that do not build are kept: a new folder that only this user
/// can enter, made with the first log.
class LogFolder {
 public:
  /// The log's file; empty where it cannot be written.
  std::string keep(const ProgramCheck& check) {
    try {
      if (path_.empty()) path_ = base::new_temporary_folder("qjulia-doctor");
      const auto file = path_ / fmt::format("{}-{}.log", check.program, to_string(check.precision));
      base::write_file(file, check.problem + "\n");
      return file.string();
    } catch (const OutputError&) {
      return {};
    } catch (const std::filesystem::filesystem_error&) {
      return {};
    }
  }

 private:
  std::filesystem::path path_;
};

std::string line(const ProgramCheck& check, const std::string& log) {
  const std::string begin = fmt::format("{:6} {:22} {}", check.has_passed() ? "ok" : "FAILED",
                                        check.program, to_string(check.precision));
  if (!log.empty()) return fmt::format("{}  did not build; the compiler's log: {}", begin, log);
  if (!check.problem.empty()) return fmt::format("{}  {}", begin, first_line(check.problem));
  return fmt::format("{}  {:7.1e} of {:7.1e}  {}", begin, check.difference, check.tolerance,
                     check.compared);
}

/// Versions, and what in the environment changes what a driver does.
std::string about(const DriverFacts& facts) {
  std::string text = fmt::format("versions: {}\n", facts.platform_version);
  if (!facts.extra_build_flags.empty()) {
    text +=
        fmt::format("flags:    PoCL adds {} to those of every program\n", facts.extra_build_flags);
  }
  for (const auto& [name, value] : facts.environment) {
    text += fmt::format("variable: {}={}\n", name, value);
  }
  return text;
}

std::string about(const Device& device) {
  const DeviceInfo& info = device.info();
  std::string text = fmt::format(
      "{}\n"
      "device:   {} by {}\n"
      "platform: {}, driver {}, {}\n"
      "limits:   {} compute units, groups of up to {}, {} KiB local memory, buffers up to {} MiB, "
      "{}\n",
      program_name(), describe(info), info.vendor, info.platform_name, info.driver_version,
      info.opencl_version, info.compute_units, info.largest_work_group, info.local_memory / 1024,
      info.largest_allocation >> 20,
      info.has_double ? "single and double precision" : "single precision only");
  for (const Precision precision : kPrecisions) {
    if (precision == Precision::dbl && !info.has_double) continue;
    const Tuning& tuning = device.tuning(precision);
    text += fmt::format("layout:   {}, {}: lane width {}, groups of {} sum together{}\n",
                        to_string(device.layout()), to_string(precision), tuning.lane_width,
                        tuning.orbit_group, device.is_tuned(precision) ? " (tuned)" : "");
  }
  return text;
}

std::string verdict(const SelfTestReport& report) {
  const auto failed = std::ranges::count_if(
      report.checks, [](const ProgramCheck& check) { return !check.has_passed(); });
  if (failed == 0) return "every program works here";
  return fmt::format(
      "{} of {} programs failed: results of this device cannot be trusted. Try a newer driver, "
      "another layout (--layout) or QJULIA_TUNING=off. When you report it, send all of the above, "
      "the compiler's logs, and what 'clinfo' says; docs/guide/devices.md says what is known of "
      "drivers.",
      failed, report.checks.size());
}

/// What can be said where there is no device to check. The error itself is for standard error.
void tell_without_device(const NoDeviceError& error, Session& session) {
  const auto findings = machine_findings();
  session.console.result(program_name() + "\nno device can be checked\n" + findings_text(findings),
                         {{"program", program_name()},
                          {"device", nullptr},
                          {"passed", false},
                          {"problem", message_of(error)},
                          {"findings", to_json(findings)}});
}

Device device_to_check(const DeviceChoice& wanted, Session& session) {
  try {
    return session.open_device({wanted, true});
  } catch (const NoDeviceError& error) {
    tell_without_device(error, session);
    throw;
  }
}

/// In processes of their own, unless there is a trace, which shows one process.
ProcessChecks checks_of(const Device& device, const DoctorArguments& arguments, Session& session) {
  if (!session.trace()) {
    return check_in_processes(device, arguments.programs,
                              std::chrono::seconds(arguments.most_seconds), session);
  }
  ProcessChecks all{{device.info(), device.layout(), {}}, {}, {}, {}, {}};
  const auto chosen = chosen_checks(device, arguments.programs);
  for (const std::size_t number : chosen) {
    throw_if_stopped(session.interrupts.token());
    const auto done = static_cast<double>(all.report.checks.size());
    session.monitor().report({"checking", done / static_cast<double>(chosen.size()), -1, {}});
    all.report.checks.push_back(self_test_check(device, number));
  }
  all.waited = device.wait_time();
  all.built = build_total();
  all.signals.resize(chosen.size());
  all.seconds.resize(chosen.size());
  return all;
}

base::Finding crash_finding(const ProgramCheck& check) {
  return {"crash", check.program,
          fmt::format("{} in {} precision: {}. A newer or an older driver may do better; commands "
                      "that need no such program work",
                      check.program, to_string(check.precision), check.problem)};
}

int run_compare_reports(const DoctorArguments& arguments, Session& session) {
  refuse(arguments.of_checks, "'doctor compare' checks no device");
  if (arguments.after.empty()) throw InputError("'doctor compare' needs two files: A.json B.json");
  session.check_outputs({arguments.before, arguments.after}, {});
  ReportComparison found =
      compare_reports(read_report(arguments.before, "A"), read_report(arguments.after, "B"));
  found.json["program"] = program_name();
  session.console.result(found.text, found.json);
  return found.is_worse ? kFailed : kDone;
}

void write_junit(const std::string& file, const std::vector<CheckSuite>& suites) {
  if (!file.empty()) base::write_file(file, junit_text(suites));
}

/// The device, its driver and its settings, in a report.
void add_device_facts(const Device& device, const DriverFacts& facts, nlohmann::json& json) {
  json["program"] = program_name();
  json["device"] = to_json(device.info());
  json["layout"] = to_string(device.layout());
  json["driver"] = to_json(facts);
  for (const Precision precision : kPrecisions) {
    json["tuning"][to_string(precision)] = to_json(device.tuning(precision));
  }
}

int run_doctor_matrix(const DoctorArguments& arguments, const Device& device, Session& session) {
  std::vector<std::string> words = {"--seconds-per-check", std::to_string(arguments.most_seconds)};
  if (!arguments.programs.empty()) {
    chosen_checks(device, arguments.programs);  // there is such a program
    words.insert(words.end(), {"--programs", arguments.programs});
  }
  const DriverFacts facts = driver_facts(device);
  const auto rows = run_matrix(device, words, session);
  std::vector<CheckSuite> suites;
  suites.reserve(rows.size());
  for (const MatrixRow& row : rows) suites.push_back({row.name, row.report, row.problem});
  write_junit(arguments.junit, suites);
  const bool has_passed = std::ranges::all_of(rows, &MatrixRow::has_passed);
  nlohmann::json json{{"passed", has_passed}, {"settings", to_json(rows)}};
  add_device_facts(device, facts, json);
  session.console.result(about(device) + about(facts) + describe(rows) +
                             (has_passed ? "every program works with every setting"
                                         : "not every program works with every setting"),
                         json);
  return has_passed ? kDone : kFailed;
}

int run_doctor(const DoctorArguments& arguments, Session& session) {
  if (arguments.checks_from) {
    return run_checks(arguments.device, arguments.programs, *arguments.checks_from, session);
  }
  if (arguments.is_comparison) return run_compare_reports(arguments, session);
  std::vector<base::Output> outputs;
  if (!arguments.junit.empty()) outputs.push_back({"--junit", arguments.junit, {".xml"}});
  session.check_outputs({}, outputs);  // there may be a trace
  const Device device = device_to_check(arguments.device, session);
  if (arguments.is_matrix) return run_doctor_matrix(arguments, device, session);
  const DriverFacts facts = driver_facts(device);  // before anything is set for processes
  const ProcessChecks checks = checks_of(device, arguments, session);
  const SelfTestReport& report = checks.report;
  std::vector<base::Finding> crashes;
  std::string text = about(device) + about(facts);
  nlohmann::json json = to_json(report);
  LogFolder logs;
  for (std::size_t i = 0; i < report.checks.size(); ++i) {
    const ProgramCheck& check = report.checks[i];
    const std::string log = check.is_built ? std::string() : logs.keep(check);
    text += line(check, log) + "\n";
    if (!log.empty()) json["programs"][i]["build_log"] = log;
    json["programs"][i]["signal"] =
        checks.signals[i] == 0 ? nlohmann::json() : nlohmann::json(checks.signals[i]);
    json["programs"][i]["seconds"] =
        checks.seconds[i] > 0 ? nlohmann::json(checks.seconds[i]) : nlohmann::json();
    if (checks.signals[i] != 0) crashes.push_back(crash_finding(check));
  }
  auto findings = machine_findings();
  const WaitTime& waited = checks.waited;
  std::ranges::move(waiting_findings(device.info(), waited), std::back_inserter(findings));
  std::ranges::move(crashes, std::back_inserter(findings));
  text += describe(checks.built) + "\n" + describe(waited) + "\n" + findings_text(findings);
  json["builds"] = {{"compiled", checks.built.compiled},
                    {"loaded", checks.built.loaded},
                    {"replaced", checks.built.replaced},
                    {"seconds", checks.built.seconds}};
  json["findings"] = to_json(findings);
  json["waiting"] = {{"seconds", waited.seconds},
                     {"processor_seconds", waited.processor_seconds},
                     {"slept_seconds", waited.slept_seconds}};
  add_device_facts(device, facts, json);
  write_junit(arguments.junit, {{to_string(device.layout()), json}});
  session.console.result(text + verdict(report), json);
  return report.has_passed() ? kDone : kFailed;
}

}  // namespace

void add_doctor(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"doctor", "Check that a device computes what it should", R"(Examples:
  qjulia doctor                   the device that commands would use
  qjulia doctor --device gpu      the GPU that ranks first
  qjulia doctor --json > report.json
  qjulia doctor --programs 'energy*' --matrix --junit doctor.xml      PoCL's settings in turns
  qjulia doctor compare report.json newer.json                        two drivers' reports
Builds every program in the layout and precision that commands would use, and compares small
results with references on the host: a few seconds, more while a driver compiles for the
first time. It also looks at the machine: GPUs that this user may not open, a container, WSL
or flatpak that hides them, limits, GPUs that two platforms show; --json has these under
"findings". Checks run in a separate process, so that a driver that crashes is reported
and the rest is checked; only this command tries a build again in which a driver
crashed. Exit code 1 when a program fails, with 'compare' when one has passed in A and not
in B, 3 when there is no device. docs/guide/devices.md says what is known of each platform,
and how to install its driver.)"},
              add_doctor_options, run_doctor);
}

}  // namespace qjulia::tools
