#include "doctor_matrix.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "base/temporary_folder.hpp"
#include "base/text.hpp"
#include "child_output.hpp"
#include "qjulia/driver_facts.hpp"
#include "qjulia/error.hpp"

namespace qjulia::tools {
namespace {

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
  const ChildOutput child = child_output(words, session.interrupts.token(), environment);
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

}  // namespace

std::vector<MatrixRow> run_matrix(const Device& device, const std::vector<std::string>& words,
                                  Session& session) {
  if (!driver_facts(device).is_pocl) {
    throw InputError(fmt::format(
        "--matrix goes through settings of PoCL, and '{}' is a device of {}; choose one of PoCL's "
        "with --device",
        device.info().name, device.info().platform_name));
  }
  std::vector<std::string> command = {
      "/proc/self/exe", "doctor",
      "--json",         "--quiet",
      "--device",       fmt::format("{}:{}", device.info().platform, device.info().index),
      "--layout",       to_string(device.layout())};
  command.insert(command.end(), words.begin(), words.end());
  auto rows = settings();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    session.console.progress(
        {"checking", static_cast<double>(i) / static_cast<double>(rows.size()), -1, rows[i].name});
    run_row(rows[i], command, session);
  }
  return rows;
}

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

nlohmann::json to_json(const std::vector<MatrixRow>& rows) {
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

}  // namespace qjulia::tools
