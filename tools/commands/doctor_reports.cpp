#include "commands/doctor_reports.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <tuple>

#include "base/markup.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::tools {
namespace {

using base::markup;

/// What went wrong in a check that has failed.
std::string problem_of(const nlohmann::json& check) {
  if (check.at("problem").is_string()) return check.at("problem");
  return fmt::format("{}: the difference {} is larger than the tolerance {}",
                     check.at("compared").get<std::string>(), check.at("difference").dump(),
                     check.at("tolerance").dump());
}

double seconds_of(const nlohmann::json& check) {
  const nlohmann::json seconds = check.value("seconds", nlohmann::json());
  return seconds.is_number() ? seconds.get<double>() : 0;
}

struct Counts {
  int tests = 0, failures = 0, errors = 0;
  double seconds = 0;

  void add(const Counts& more) {
    tests += more.tests;
    failures += more.failures;
    errors += more.errors;
    seconds += more.seconds;
  }
  std::string attributes() const {
    return fmt::format(R"(tests="{}" failures="{}" errors="{}" time="{:.3f}")", tests, failures,
                       errors, seconds);
  }
};

std::string test_case(const std::string& suite, const nlohmann::json& check, Counts& counts) {
  ++counts.tests;
  counts.seconds += seconds_of(check);
  std::string text =
      fmt::format("  <testcase classname=\"doctor.{}\" name=\"{} ({})\" time=\"{:.3f}\"",
                  markup(suite), markup(check.at("program").get<std::string>()),
                  markup(check.at("precision").get<std::string>()), seconds_of(check));
  if (check.at("passed") == true) return text + "/>\n";
  const bool is_failure = check.at("problem").is_null();
  ++(is_failure ? counts.failures : counts.errors);
  const std::string problem = problem_of(check);
  const char* const tag = is_failure ? "failure" : "error";
  return text + fmt::format(">\n   <{} message=\"{}\">{}</{}>\n  </testcase>\n", tag,
                            markup(first_line(problem)), markup(problem), tag);
}

std::string test_suite(const CheckSuite& suite, Counts& total) {
  Counts counts;
  std::string cases;
  if (suite.report.is_null() || !suite.report.contains("programs")) {
    counts = {.tests = 1, .errors = 1};
    cases = fmt::format(
        "  <testcase classname=\"doctor.{}\" name=\"doctor\">\n   <error "
        "message=\"{}\">{}</error>\n"
        "  </testcase>\n",
        markup(suite.name), markup(first_line(suite.problem)), markup(suite.problem));
  } else {
    for (const nlohmann::json& check : suite.report["programs"])
      cases += test_case(suite.name, check, counts);
  }
  total.add(counts);
  return fmt::format(" <testsuite name=\"{}\" {}>\n{} </testsuite>\n", markup(suite.name),
                     counts.attributes(), cases);
}

/// Setting (empty but for a matrix), program and precision.
using CheckKey = std::tuple<std::string, std::string, std::string>;

struct Result {
  bool has_passed = false;
  nlohmann::json difference;
};

struct Report {
  std::map<CheckKey, Result> results;
  std::map<std::string, std::string> circumstances;
};

/// Every value below `value`, by its path.
void add_circumstances(const std::string& name, const nlohmann::json& value, Report& report) {
  if (!value.is_object()) {
    report.circumstances[name] = value.is_string() ? value.get<std::string>() : value.dump();
    return;
  }
  for (const auto& [key, below] : value.items()) {
    add_circumstances(name.empty() ? key : fmt::format("{}.{}", name, key), below, report);
  }
}

void add_results(const std::string& setting, const nlohmann::json& one, Report& report) {
  for (const nlohmann::json& check : one.at("programs")) {
    report.results[{setting, check.at("program"), check.at("precision")}] = {
        check.at("passed").get<bool>(), check.at("difference")};
  }
}

Report report_of(const nlohmann::json& all, const std::string& which) {
  Report report;
  try {
    report.circumstances["program"] = all.at("program").get<std::string>();
    for (const char* name : {"name", "platform", "driver"}) {
      report.circumstances[std::string("device.") + name] = all.at("device").at(name);
    }
    for (const char* name : {"layout", "tuning", "driver"}) {
      add_circumstances(name, all.value(name, nlohmann::json()), report);
    }
    if (!all.contains("settings")) {
      add_results({}, all, report);
      return report;
    }
    for (const nlohmann::json& setting : all.at("settings")) {
      if (!setting.at("report").is_null()) {
        add_results(setting.at("name"), setting.at("report"), report);
      }
    }
  } catch (const nlohmann::json::exception&) {
    throw InputError(
        fmt::format("{} is not a report of a device; make it with 'qjulia doctor --json'", which));
  }
  return report;
}

std::vector<std::string> differences(const Report& before, const Report& after) {
  const auto value = [](const Report& report, const std::string& name) {
    const auto found = report.circumstances.find(name);
    return found == report.circumstances.end() ? std::string("nothing") : found->second;
  };
  std::map<std::string, std::string> all = before.circumstances;
  all.insert(after.circumstances.begin(), after.circumstances.end());
  std::vector<std::string> lines;
  for (const auto& [name, ignored] : all) {
    const std::string old = value(before, name), now = value(after, name);
    if (old != now) lines.push_back(fmt::format("{}: {} in A, {} in B", name, old, now));
  }
  return lines;
}

std::string state_of(const Result* result) {
  if (result == nullptr) return "absent";
  return result->has_passed ? "passed" : "failed";
}

/// "worse", "better", "result" (both passed, to other digits) or "same".
std::string change(const Result* before, const Result* after) {
  const bool was_good = before != nullptr && before->has_passed;
  const bool is_good = after != nullptr && after->has_passed;
  if (was_good != is_good) return is_good ? "better" : "worse";
  if (!is_good || before->difference == after->difference) return "same";
  return "result";
}

std::string shown(const Result* result) {
  if (result == nullptr || !result->has_passed || !result->difference.is_number()) {
    return state_of(result);
  }
  return fmt::format("{:.3g}", result->difference.get<double>());
}

}  // namespace

std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

std::string junit_text(const std::vector<CheckSuite>& suites) {
  Counts total;
  std::string text;
  for (const CheckSuite& suite : suites) text += test_suite(suite, total);
  return fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"qjulia doctor\" {}>\n{}"
      "</testsuites>\n",
      total.attributes(), text);
}

ReportComparison compare_reports(const nlohmann::json& before, const nlohmann::json& after) {
  const Report old = report_of(before, "A"), now = report_of(after, "B");
  if (before.contains("settings") != after.contains("settings")) {
    throw InputError("only one of A and B was made by 'doctor matrix'; make both in the same way");
  }
  std::map<CheckKey, std::pair<const Result*, const Result*>> pairs;
  for (const auto& [key, result] : old.results) pairs[key].first = &result;
  for (const auto& [key, result] : now.results) pairs[key].second = &result;
  std::map<std::string, int> counts{{"worse", 0}, {"better", 0}, {"result", 0}, {"same", 0}};
  ReportComparison comparison;
  nlohmann::json programs = nlohmann::json::array();
  for (const auto& [key, pair] : pairs) {
    const auto& [setting, program, precision] = key;
    const auto& [x, y] = pair;
    const std::string kind = change(x, y);
    ++counts[kind];
    programs.push_back({{"setting", setting.empty() ? nlohmann::json() : nlohmann::json(setting)},
                        {"program", program},
                        {"precision", precision},
                        {"before", state_of(x)},
                        {"after", state_of(y)},
                        {"before_difference", x == nullptr ? nlohmann::json() : x->difference},
                        {"after_difference", y == nullptr ? nlohmann::json() : y->difference},
                        {"change", kind}});
    if (kind == "same") continue;
    comparison.text +=
        fmt::format("{:8} {:22} {:8} {}{} in A, {} in B\n", kind == "result" ? "other" : kind,
                    program, precision, setting.empty() ? "" : setting + ": ", shown(x), shown(y));
  }
  const auto lines = differences(old, now);
  std::string beside;
  for (const std::string& line : lines) beside += "differs: " + line + "\n";
  comparison.text = beside + comparison.text +
                    fmt::format(
                        "{} checks worse, {} better, {} passed with other differences, {} "
                        "the same",
                        counts["worse"], counts["better"], counts["result"], counts["same"]);
  comparison.is_worse = counts["worse"] > 0;
  comparison.json = {{"passed", !comparison.is_worse},
                     {"counts", nlohmann::json(counts)},
                     {"differences", lines},
                     {"programs", programs}};
  return comparison;
}

}  // namespace qjulia::tools
