#pragma once
/// The checks of `qjulia doctor` in a process of their own, which a driver may crash.

#include <chrono>
#include <nlohmann/json.hpp>
#include <vector>

#include "qjulia/build_total.hpp"
#include "qjulia/self_test.hpp"
#include "session.hpp"

namespace qjulia::tools {

struct ProcessChecks {
  SelfTestReport report;
  std::vector<int> signals;  ///< for each check: what ended the process in it; 0: nothing has
  WaitTime waited;
  BuildTotal built;
};

/// All of `self_test`. Where a process ends in a check, that check has failed, and another process
/// takes the next ones.
/// @param most the time that a check may take before its process is ended.
/// @throws Error where no process can be started; Interrupted
ProcessChecks check_in_processes(const Device& device, std::chrono::seconds most, Session& session);

/// What such a process does: the checks from number `first` on, each with a line of JSON before it
/// and one after it on standard output.
int run_checks(const DeviceChoice& wanted, int first, Session& session);

/// "compiled 5 programs and loaded 3 that were kept, in 1.2 s".
std::string describe(const BuildTotal& built);

}  // namespace qjulia::tools
