#pragma once
/// What 'qjulia profile' prints.

#include <string>

#include "qjulia/profile.hpp"
#include "qjulia/scaling.hpp"
#include "qjulia/tune.hpp"

namespace qjulia::tools {

/// Lines, without an end of line after the last.
std::string table(const ProfileReport& report);
std::string table(const ScalingReport& report);
/// @param file that the settings are kept in.
std::string table(const TuneReport& report, const std::string& file);
std::string table(const GridReport& report);

}  // namespace qjulia::tools
