#pragma once
/// Whether a device computes what it should.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "qjulia/device.hpp"
#include "qjulia/progress.hpp"

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

nlohmann::json to_json(const SelfTestReport& report);

}  // namespace qjulia
