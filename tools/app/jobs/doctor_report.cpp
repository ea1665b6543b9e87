#include "jobs/doctor_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iterator>

#include "base/output_file.hpp"
#include "base/temporary_folder.hpp"
#include "describe/provenance.hpp"
#include "jobs/machine_findings.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::tools {
namespace {

base::Finding crash_finding(const ProgramCheck& check) {
  return {"crash", check.program,
          fmt::format("{} in {} precision: {}. A newer or an older driver may do better; commands "
                      "that need no such program work",
                      check.program, to_string(check.precision), check.problem)};
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

}  // namespace

std::vector<base::Finding> doctor_findings(const Device& device, const DriverFacts& facts,
                                           const ProcessChecks& checks) {
  auto findings = machine_findings();
  std::ranges::move(waiting_findings(device.info(), checks.waited), std::back_inserter(findings));
  std::ranges::move(driver_findings(device, facts), std::back_inserter(findings));
  for (std::size_t i = 0; i < checks.signals.size(); ++i) {
    if (checks.signals[i] != 0) findings.push_back(crash_finding(checks.report.checks[i]));
  }
  return findings;
}

nlohmann::json doctor_report(const Device& device, const DriverFacts& facts,
                             const ProcessChecks& checks,
                             const std::vector<base::Finding>& findings) {
  nlohmann::json json = to_json(checks.report);
  for (std::size_t i = 0; i < checks.report.checks.size(); ++i) {
    json["programs"][i]["signal"] =
        checks.signals[i] == 0 ? nlohmann::json() : nlohmann::json(checks.signals[i]);
    json["programs"][i]["seconds"] =
        checks.seconds[i] > 0 ? nlohmann::json(checks.seconds[i]) : nlohmann::json();
  }
  json["builds"] = {{"compiled", checks.built.compiled},
                    {"loaded", checks.built.loaded},
                    {"replaced", checks.built.replaced},
                    {"seconds", checks.built.seconds}};
  json["findings"] = to_json(findings);
  json["waiting"] = {{"seconds", checks.waited.seconds},
                     {"processor_seconds", checks.waited.processor_seconds},
                     {"slept_seconds", checks.waited.slept_seconds}};
  add_device_facts(device, facts, json);
  return json;
}

void keep_build_logs(const SelfTestReport& report, nlohmann::json& json) {
  LogFolder logs;
  for (std::size_t i = 0; i < report.checks.size(); ++i) {
    const ProgramCheck& check = report.checks[i];
    if (check.is_built) continue;
    if (const std::string log = logs.keep(check); !log.empty()) {
      json["programs"][i]["build_log"] = log;
    }
  }
}

void add_device_facts(const Device& device, const DriverFacts& facts, nlohmann::json& json) {
  json["program"] = program_name();
  json["device"] = to_json(device.info());
  json["layout"] = to_string(device.layout());
  json["driver"] = to_json(facts);
  for (const Precision precision : kPrecisions) {
    json["tuning"][to_string(precision)] = to_json(device.tuning(precision));
  }
}

}  // namespace qjulia::tools
