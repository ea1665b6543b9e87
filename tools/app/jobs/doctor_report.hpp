#pragma once
/// What `qjulia doctor` reports of a device, for the command and for Python.

#include <nlohmann/json.hpp>
#include <vector>

#include "base/surroundings.hpp"
#include "jobs/check_process.hpp"
#include "qjulia/device/driver_facts.hpp"

namespace qjulia::tools {

/// What is known of the machine and the driver, and checks that ended their process.
std::vector<base::Finding> doctor_findings(const Device& device, const DriverFacts& facts,
                                           const ProcessChecks& checks);

/// The results with all that `add_device_facts` adds, the findings, builds and waiting.
nlohmann::json doctor_report(const Device& device, const DriverFacts& facts,
                             const ProcessChecks& checks,
                             const std::vector<base::Finding>& findings);

/// Writes the compilers' logs of programs that do not build to files, and says in the report which
/// file each has ("build_log"). A log that cannot be written is left out.
void keep_build_logs(const SelfTestReport& report, nlohmann::json& json);

/// The device, its driver and its settings, added to a report.
void add_device_facts(const Device& device, const DriverFacts& facts, nlohmann::json& json);

}  // namespace qjulia::tools
