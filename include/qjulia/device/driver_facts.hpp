#pragma once
/// What a report of a driver's fault needs to be repeated: versions, flags and environment.

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "qjulia/device/device.hpp"

namespace qjulia {

struct DriverFacts {
  bool is_pocl = false;
  std::string platform_version;  ///< in the platform's own words
  std::string pocl, llvm;        ///< versions in them; empty where there are none
  /// What every program is compiled with; programs add -D of their own.
  std::map<Precision, std::string> build_flags{};
  /// Flags that PoCL adds without a word (POCL_EXTRA_BUILD_FLAGS); empty: none.
  std::string extra_build_flags{};
  /// Whether it compiles kernels whose work-items wait for one another rightly or wrongly by
  /// chance: kernels do without then, unless settings ask for it.
  bool may_miscompile_barriers = false;
  /// Variables that OpenCL's loaders, PoCL, Mesa, GPU drivers and this library read, where they are
  /// set.
  std::map<std::string, std::string> environment{};
};

DriverFacts driver_facts(const Device& device);

nlohmann::json to_json(const DriverFacts& facts);

}  // namespace qjulia
