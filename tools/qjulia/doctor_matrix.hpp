#pragma once
/// The checks of `qjulia doctor` under one setting of PoCL after the other.

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "qjulia/device.hpp"
#include "session.hpp"

namespace qjulia::tools {

struct MatrixRow {
  std::string name;
  std::map<std::string, std::string> environment;  ///< that the row sets
  bool is_known = true;   ///< false: the driver said that it does not know the setting
  nlohmann::json report;  ///< of doctor; null where there is none
  std::string problem{};  ///< why there is none
  std::vector<std::string> messages{};  ///< on standard error
  bool has_passed() const { return report.is_object() && report.value("passed", false); }
};

/// Runs doctor for the device once for each setting, in a process and with a cache of its own.
/// @param words further options of each, such as --programs.
/// @throws InputError where the device is not PoCL's; Interrupted
std::vector<MatrixRow> run_matrix(const Device& device, const std::vector<std::string>& words,
                                  Session& session);

/// A table, and what failed.
std::string describe(const std::vector<MatrixRow>& rows);

nlohmann::json to_json(const std::vector<MatrixRow>& rows);

}  // namespace qjulia::tools
