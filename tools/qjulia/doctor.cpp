/// qjulia doctor: does a device compute what it should?

#include <fmt/format.h>
#include <stdlib.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>

#include "base/output_file.hpp"
#include "check_process.hpp"
#include "commands.hpp"
#include "failure.hpp"
#include "machine_findings.hpp"
#include "provenance.hpp"
#include "qjulia/error.hpp"
#include "qjulia/self_test.hpp"

namespace qjulia::tools {
namespace {

struct DoctorArguments {
  DeviceChoice device;
  std::optional<int> checks_from;  ///< in a process for the checks: the first of them
  int most_seconds = 600;          ///< for one check, whose compiler may hang
};

void add_doctor_options(Command command, DoctorArguments& a) {
  command
      .add("--checks-from", &a.checks_from, "N",
           "Given by this program to processes that run its checks")
      .range(0, 1000)
      .group("");
  command.add("--seconds-per-check", &a.most_seconds, "S", "For tests of a compiler that hangs")
      .range(1, 86400)
      .group("");
  add_device(command, a.device);
}

/// Where compilers' logs of programs that do not build are kept: a new folder that only this user
/// can enter, made with the first log.
class LogFolder {
 public:
  /// The log's file; empty where it cannot be written.
  std::string keep(const ProgramCheck& check) {
    try {
      if (path_.empty()) path_ = new_folder();
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
  static std::filesystem::path new_folder() {
    std::string name = (std::filesystem::temp_directory_path() / "qjulia-doctor-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) throw OutputError("cannot make a temporary folder");
    return name;
  }

  std::filesystem::path path_;
};

std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

std::string line(const ProgramCheck& check, const std::string& log) {
  const std::string begin = fmt::format("{:6} {:22} {}", check.has_passed() ? "ok" : "FAILED",
                                        check.program, to_string(check.precision));
  if (!log.empty()) return fmt::format("{}  did not build; the compiler's log: {}", begin, log);
  if (!check.problem.empty()) return fmt::format("{}  {}", begin, first_line(check.problem));
  return fmt::format("{}  {:7.1e} of {:7.1e}  {}", begin, check.difference, check.tolerance,
                     check.compared);
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
ProcessChecks checks_of(const Device& device, std::chrono::seconds most, Session& session) {
  if (!session.trace()) return check_in_processes(device, most, session);
  ProcessChecks all{self_test(device, session.monitor()), {}, device.wait_time(), build_total()};
  all.signals.resize(all.report.checks.size());
  return all;
}

base::Finding crash_finding(const ProgramCheck& check) {
  return {"crash", check.program,
          fmt::format("{} in {} precision: {}. A newer or an older driver may do better; commands "
                      "that need no such program work",
                      check.program, to_string(check.precision), check.problem)};
}

int run_doctor(const DoctorArguments& arguments, Session& session) {
  if (arguments.checks_from) return run_checks(arguments.device, *arguments.checks_from, session);
  session.check_outputs({}, {});  // there may be a trace
  const Device device = device_to_check(arguments.device, session);
  const ProcessChecks checks =
      checks_of(device, std::chrono::seconds(arguments.most_seconds), session);
  const SelfTestReport& report = checks.report;
  std::vector<base::Finding> crashes;
  std::string text = about(device);
  nlohmann::json json = to_json(report);
  LogFolder logs;
  for (std::size_t i = 0; i < report.checks.size(); ++i) {
    const ProgramCheck& check = report.checks[i];
    const std::string log = check.is_built ? std::string() : logs.keep(check);
    text += line(check, log) + "\n";
    if (!log.empty()) json["programs"][i]["build_log"] = log;
    json["programs"][i]["signal"] =
        checks.signals[i] == 0 ? nlohmann::json() : nlohmann::json(checks.signals[i]);
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
  json["program"] = program_name();
  json["device"] = to_json(device.info());
  for (const Precision precision : kPrecisions) {
    json["tuning"][to_string(precision)] = to_json(device.tuning(precision));
  }
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
Builds every program in the layout and precision that commands would use, and compares small
results with references on the host: a few seconds, more while a driver compiles for the
first time. It also looks at the machine: GPUs that this user may not open, a container, WSL
or flatpak that hides them, limits, GPUs that two platforms show; --json has these under
"findings". Checks run in a separate process, so that a driver that crashes is reported
and the rest is checked; only this command tries a build again in which a driver
crashed. Exit code 1 when a program fails, 3 when there is no device. docs/guide/devices.md
says what is known of each platform, and how to install its driver.)"},
              add_doctor_options, run_doctor);
}

}  // namespace qjulia::tools
