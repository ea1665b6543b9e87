#pragma once
/// The checks of `qjulia doctor`, in this process or in one of their own, which a driver may crash.

#include <chrono>
#include <nlohmann/json.hpp>
#include <vector>

#include "base/build_total.hpp"
#include "jobs/session.hpp"
#include "qjulia/check/self_test.hpp"

namespace qjulia::tools {

struct ProcessChecks {
  SelfTestReport report;
  std::vector<int> signals;     ///< for each check: what ended the process in it; 0: nothing has
  std::vector<double> seconds;  ///< of each check, with what it builds; 0: not known
  WaitTime waited;
  base::BuildTotal built;
};

/// The numbers, in `self_test_plan`, of checks of programs with these names.
/// @param programs names with * and ?, between commas; empty: all.
/// @throws InputError where there are none
std::vector<std::size_t> chosen_checks(const Device& device, const std::string& programs);

/// These checks of `self_test`, in this process, which a driver that crashes ends.
/// @throws InputError as `chosen_checks`; Interrupted
ProcessChecks check_here(const Device& device, const std::string& programs,
                         const ProgressMonitor& monitor);

/// These checks of `self_test`. Where a process ends in a check, that check has failed, and another
/// process takes the next ones.
/// @param most the time that a check may take before its process is ended.
/// @throws Error where no process can be started; InputError as `chosen_checks`; Interrupted
ProcessChecks check_in_processes(const Device& device, const std::string& programs,
                                 std::chrono::seconds most, Session& session);

/// What such a process does: the chosen checks without the first ones, each with a line of JSON
/// before it and one after it on standard output.
int run_checks(const DeviceChoice& wanted, const std::string& programs, int first,
               Session& session);

/// "compiled 5 programs and loaded 3 that were kept, in 1.2 s".
std::string describe(const base::BuildTotal& built);

}  // namespace qjulia::tools
