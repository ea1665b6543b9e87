/// qjulia doctor matrix: the checks under one setting of PoCL after the other.

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "base/temporary_folder.hpp"
#include "base/text.hpp"
#include "commands/doctor_commands.hpp"
#include "console/child_output.hpp"
#include "console/failure.hpp"
#include "jobs/check_process.hpp"
#include "jobs/doctor_report.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/device/driver_facts.hpp"

namespace qjulia::tools {
namespace {

struct MatrixRow {
  std::string name;
  std::map<std::string, std::string> environment;  ///< that the row sets
  bool is_known = true;   ///< false: the driver said that it does not know the setting
  nlohmann::json report;  ///< of doctor; null where there is none
  std::string problem{};  ///< why there is none
  std::vector<std::string> messages{};  ///< on standard error
  bool has_passed() const { return report.is_object() && report.value("passed", false); }
};

/// Drivers of other releases ignore variables that they do not know: POCL_MAX_PTHREAD_COUNT is PoCL
/// 3's, POCL_CPU_MAX_CU_COUNT PoCL 6's.
std::vector<MatrixRow> settings() {
  const auto method = [](const char* name) {
    return MatrixRow{name, {{"POCL_WORK_GROUP_METHOD", name}}, true, {}};
  };
  return {
      {"as it is", {}, true, {}},
      method("loopvec"),
      method("workitemloops"),  // PoCL runs no vectoriser with it
      method("cbs"),
      {"one thread", {{"POCL_MAX_PTHREAD_COUNT", "1"}, {"POCL_CPU_MAX_CU_COUNT", "1"}}, true, {}},
      {"any group size", {{"POCL_WORK_GROUP_SPECIALIZATION", "0"}}, true, {}},
      {"no optimiser", {{"POCL_EXTRA_BUILD_FLAGS", "-cl-opt-disable"}}, true, {}},
      {"no cache", {{"POCL_KERNEL_CACHE", "0"}}, true, {}}};
}

void run_row(MatrixRow& row, const std::vector<std::string>& words, Session& session) {
  const base::TemporaryFolder cache("qjulia-doctor");
  auto environment = row.environment;
  environment["POCL_CACHE_DIR"] = cache.path().string();
  const ChildOutput child = child_output(words, session.stop(), environment);
  std::istringstream lines(child.err);
  for (std::string line; std::getline(lines, line);) {
    line = base::to_utf8(line);
    if (line.starts_with("Unknown work group")) row.is_known = false;
    if (line.empty() || std::ranges::count(row.messages, line) > 0) continue;
    constexpr std::size_t kMost = 20;
    if (row.messages.size() < kMost) row.messages.push_back(line);
  }
  row.report = nlohmann::json::parse(child.out, nullptr, false);
  if (row.report.is_object() && row.report.contains("programs")) return;
  row.report = nullptr;
  row.problem = fmt::format("it ended with exit code {}{}", child.exit_code,
                            row.messages.empty() ? "" : ": " + row.messages.back());
}

/// How many checks give the same difference as in `first`, to the last digit.
int same_as(const nlohmann::json& first, const nlohmann::json& report) {
  int same = 0;
  const nlohmann::json &old = first["programs"], &now = report["programs"];
  for (std::size_t i = 0; i < std::min(old.size(), now.size()); ++i) {
    same += old[i]["difference"] == now[i]["difference"] ? 1 : 0;
  }
  return same;
}

std::string failures(const MatrixRow& row) {
  std::string text;
  for (const nlohmann::json& check : row.report["programs"]) {
    if (check["passed"] == true) continue;
    const std::string problem = check["problem"].is_string()
                                    ? check["problem"].get<std::string>()
                                    : "differs by " + check["difference"].dump();
    text +=
        fmt::format("FAILED {}: {} {}: {}\n", row.name, check["program"].get<std::string>(),
                    check["precision"].get<std::string>(), problem.substr(0, problem.find('\n')));
  }
  return text;
}

/// Runs the checks of the device once for each setting, in a process and with a cache of its own.
/// @param words further options of each, such as --programs.
/// @throws InputError where the device is not PoCL's; Interrupted
std::vector<MatrixRow> run_matrix(const Device& device, const std::vector<std::string>& words,
                                  Session& session) {
  if (!driver_facts(device).is_pocl) {
    throw InputError(
        fmt::format("the matrix goes through settings of PoCL, and '{}' is a device of {}; choose "
                    "one of PoCL's "
                    "with --device",
                    device.info().name, device.info().platform_name));
  }
  std::vector<std::string> command = {
      "/proc/self/exe",
      "doctor",
      "check",
      "--json",
      "--quiet",
      "--device",
      fmt::format("{}:{}", device.info().platform, device.info().index),
      "--layout",
      to_string(device.layout())};
  command.insert(command.end(), words.begin(), words.end());
  auto rows = settings();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    session.console.progress(
        {"checking", static_cast<double>(i) / static_cast<double>(rows.size()), -1, rows[i].name});
    run_row(rows[i], command, session);
  }
  return rows;
}

/// A table, and what failed.
std::string describe(const std::vector<MatrixRow>& rows) {
  std::string text = fmt::format("{:16} {:>10} {:>12} {:>13}  {}\n", "setting", "passed",
                                 "same digits", "built in", "environment");
  std::string failed;
  for (const MatrixRow& row : rows) {
    std::string environment;
    for (const auto& [name, value] : row.environment) {
      environment += fmt::format("{}{}={}", environment.empty() ? "" : " ", name, value);
    }
    if (!row.is_known) environment += " (unknown to this driver)";
    if (row.report.is_null()) {
      text +=
          fmt::format("{:16} {:>10} {:>12} {:>13}  {}\n", row.name, "none", "", "", environment);
      failed += fmt::format("FAILED {}: {}\n", row.name, row.problem);
      continue;
    }
    const nlohmann::json& programs = row.report["programs"];
    const auto passed = std::ranges::count_if(
        programs, [](const nlohmann::json& check) { return check["passed"] == true; });
    const std::string same =
        rows.front().report.is_null()
            ? ""
            : fmt::format("{} of {}", same_as(rows.front().report, row.report), programs.size());
    text += fmt::format("{:16} {:>10} {:>12} {:>11.1f} s  {}\n", row.name,
                        fmt::format("{} of {}", passed, programs.size()), same,
                        row.report["builds"]["seconds"].get<double>(), environment);
    failed += failures(row);
  }
  return text + failed;
}

nlohmann::json rows_json(const std::vector<MatrixRow>& rows) {
  nlohmann::json all = nlohmann::json::array();
  for (const MatrixRow& row : rows) {
    all.push_back(
        {{"name", row.name},
         {"environment", nlohmann::json(row.environment)},
         {"known", row.is_known},
         {"passed", row.has_passed()},
         {"problem", row.problem.empty() ? nlohmann::json() : nlohmann::json(row.problem)},
         {"messages", row.messages},
         {"report", row.report}});
  }
  return all;
}

int run_doctor_matrix(const DoctorArguments& arguments, Session& session) {
  const Device device = device_to_check(arguments, session);
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
  nlohmann::json json{{"passed", has_passed}, {"settings", rows_json(rows)}};
  add_device_facts(device, facts, json);
  session.console.result(about(device, facts) + describe(rows) +
                             (has_passed ? "every program works with every setting"
                                         : "not every program works with every setting"),
                         json);
  return has_passed ? kDone : kFailed;
}

}  // namespace

void add_doctor_matrix(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"doctor matrix", "Check a device under each of PoCL's settings",
               R"(Examples:
  qjulia doctor matrix
  qjulia doctor matrix --programs 'energy*' --junit doctor.xml    a suite for each setting
The settings are PoCL's methods for work-groups, one thread, no specialisation, no optimiser, no
cache. Each runs in a process and with an empty cache of its own, so that all compile everything.
Exit code 1 when a program fails with any of them, 3 when there is no device.)"},
              add_checks, run_doctor_matrix);
}

}  // namespace qjulia::tools
