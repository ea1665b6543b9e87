#pragma once
/// Whether a device computes what it should.

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "qjulia/base/progress.hpp"
#include "qjulia/device/device.hpp"

namespace qjulia {

/// One program of kernels at one precision.
struct ProgramCheck {
  std::string program;  ///< its file, such as "energy.cl"
  Precision precision = Precision::single;
  std::string compared;   ///< what was compared with what
  double difference = 0;  ///< largest difference from what is right; infinite where none was found
  double tolerance = 0;   ///< what `difference` must not exceed
  std::string problem;    ///< why nothing could be compared; empty where it could
  bool is_built = true;   ///< false: `problem` is the compiler's log
  bool has_passed() const { return problem.empty() && difference <= tolerance; }
};

struct SelfTestReport {
  DeviceInfo device;
  Layout layout = Layout::cpu;
  std::vector<ProgramCheck> checks;
  bool has_passed() const;
};

/// Builds every program in the device's layout, in double precision too where the device has it,
/// and compares results of small size with references on the host or closed forms: about a second a
/// program, besides building it. What fails is in the report.
SelfTestReport self_test(const Device& device, const ProgressMonitor& monitor = {});

/// What `self_test` checks on this device, in order, without results: `difference` is infinite.
std::vector<ProgramCheck> self_test_plan(const Device& device);

/// Runs one of these checks, so that a program can run each where a driver that crashes does no
/// harm. @param number its place in the plan, from 0. @throws OptionError naming "number".
ProgramCheck self_test_check(const Device& device, std::size_t number);

/// The programs that most work needs, in single precision: about a second, besides building them.
SelfTestReport quick_self_test(const Device& device, const ProgressMonitor& monitor = {});

/// `quick_self_test` once for each device, driver, layout, tuning and set of kernels: that it was
/// passed is kept in the user's folder for caches, beside tuned settings.
/// @return none where it has been passed before.
std::optional<SelfTestReport> first_self_test(const Device& device,
                                              const ProgressMonitor& monitor = {});

nlohmann::json to_json(const ProgramCheck& check);
nlohmann::json to_json(const SelfTestReport& report);

}  // namespace qjulia
