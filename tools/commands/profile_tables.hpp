#pragma once
/// What 'qjulia profile' prints.

#include <string>

#include "qjulia/profile/profile.hpp"
#include "qjulia/profile/scaling.hpp"
#include "qjulia/profile/tune.hpp"

namespace qjulia::tools {

/// Lines, without an end of line after the last.
std::string profile_table(const ProfileReport& report);
/// What was counted of each kernel, and what it needs.
std::string counter_table(const ProfileReport& report);
std::string profile_table(const ScalingReport& report);
/// @param file that the settings are kept in.
std::string profile_table(const TuneReport& report, const std::string& file);
std::string profile_table(const GridReport& report);

}  // namespace qjulia::tools
