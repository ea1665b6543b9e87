#pragma once
/// Profiles in the formats of other programs.

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace qjulia::tools {

/// The words of `profile measure --export`.
inline const std::vector<std::string> kProfileFormats{"google-benchmark", "bencher", "lines",
                                                      "pasteable"};
/// @param report the JSON of `profile measure`, with `run_facts` as "made". @param table of it.
/// @param format one of `kProfileFormats`.
std::string exported_profile(const nlohmann::json& report, const std::string& table,
                             std::string_view format);

/// The words of `profile tune --export` and `profile grid --export`.
inline const std::vector<std::string> kTuningFormats{"t4", "t1"};
/// @param report the JSON of either. @param format one of `kTuningFormats`.
std::string exported_tuning(const nlohmann::json& report, std::string_view format);

}  // namespace qjulia::tools
