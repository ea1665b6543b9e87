/// qjulia doctor check: each program of a device against a reference.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands/doctor_commands.hpp"
#include "console/failure.hpp"
#include "jobs/check_process.hpp"
#include "jobs/doctor_report.hpp"
#include "jobs/machine_findings.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/check/self_test.hpp"

namespace qjulia::tools {
namespace {

struct DoctorCheckArguments : DoctorArguments {
  std::optional<int> checks_from;  ///< in a process for the checks: the first of them
};

std::string line(const ProgramCheck& check, const std::string& log) {
  const std::string begin = fmt::format("{:6} {:22} {}", check.has_passed() ? "ok" : "FAILED",
                                        check.program, to_string(check.precision));
  if (!log.empty()) return fmt::format("{}  did not build; the compiler's log: {}", begin, log);
  if (!check.problem.empty()) return fmt::format("{}  {}", begin, first_line(check.problem));
  return fmt::format("{}  {:7.1e} of {:7.1e}  {}", begin, check.difference, check.tolerance,
                     check.compared);
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

/// In processes of their own, unless there is a trace, which shows one process.
ProcessChecks checks_of(const Device& device, const DoctorCheckArguments& arguments,
                        Session& session) {
  if (!session.trace()) {
    return check_in_processes(device, arguments.programs,
                              std::chrono::seconds(arguments.most_seconds), session);
  }
  return check_here(device, arguments.programs, session.monitor());
}

int run_doctor_check(const DoctorCheckArguments& arguments, Session& session) {
  if (arguments.checks_from) {
    return run_checks(arguments.device, arguments.programs, *arguments.checks_from, session);
  }
  const Device device = device_to_check(arguments, session);
  const DriverFacts facts = driver_facts(device);  // before anything is set for processes
  const ProcessChecks checks = checks_of(device, arguments, session);
  const SelfTestReport& report = checks.report;
  const auto findings = doctor_findings(device, facts, checks);
  std::string text = about(device, facts);
  nlohmann::json json = doctor_report(device, facts, checks, findings);
  keep_build_logs(report, json);
  for (std::size_t i = 0; i < report.checks.size(); ++i) {
    text += line(report.checks[i], json["programs"][i].value("build_log", "")) + "\n";
  }
  text += describe(checks.built) + "\n" + describe(checks.waited) + "\n" + findings_text(findings);
  write_junit(arguments.junit, {{to_string(device.layout()), json}});
  session.console.result(text + verdict(report), json);
  return report.has_passed() ? kDone : kFailed;
}

void describe_doctor_check(Command command, DoctorCheckArguments& a) {
  command
      .add("--checks-from", &a.checks_from, "N",
           "Given by this program to processes that run its checks")
      .range(0, 1000)
      .group("");
  add_checks(command, a);
}

}  // namespace

void add_doctor_check(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen, {"doctor check", "Check every program of a device", R"(Examples:
  qjulia doctor check
  qjulia doctor check --device gpu
  qjulia doctor check --json > report.json
  qjulia doctor check --programs 'energy*' --junit doctor.xml
Builds every program in the layout and precision that commands would use, and compares small
results with references on the host: a few seconds, more while a driver compiles for the
first time. It also looks at the machine: GPUs that this user may not open, a container, WSL
or flatpak that hides them, limits, GPUs that two platforms show; --json has these under
"findings". Checks run in a separate process, so that a driver that crashes is reported
and the rest is checked; only this command tries a build again in which a driver
crashed. Exit code 1 when a program fails, 3 when there is no device. docs/guide/devices.md says what is known of each platform,
and how to install its driver.)"},
              describe_doctor_check, run_doctor_check);
}

}  // namespace qjulia::tools
