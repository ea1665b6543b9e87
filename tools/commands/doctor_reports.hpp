#pragma once
/// Reports of `qjulia doctor --json` for programs that collect tests' results, and two of them
/// compared.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace qjulia::tools {

std::string first_line(const std::string& text);

/// A report as one suite of tests.
struct CheckSuite {
  std::string name;
  nlohmann::json report;  ///< null where the process that was to make it failed: see `problem`
  std::string problem{};
};

/// JUnit's XML, as Jenkins, GitLab and others read it. A program that computes wrongly is a
/// failure; one that does not build, crashes or hangs is an error.
std::string junit_text(const std::vector<CheckSuite>& suites);

/// What changed from one report to another.
struct ReportComparison {
  std::string text;
  nlohmann::json json;
  bool is_worse = false;  ///< a program passed before, and has failed or is gone
};

/// @param before, after of 'doctor --json', both of 'doctor check' or both of 'doctor matrix'.
/// @throws InputError for what is no such report, naming it A or B.
ReportComparison compare_reports(const nlohmann::json& before, const nlohmann::json& after);

}  // namespace qjulia::tools
