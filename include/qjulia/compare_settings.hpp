#pragma once
/// The settings of a comparison, described.

#include <span>

#include "qjulia/compare.hpp"
#include "qjulia/setting.hpp"

namespace qjulia {

std::span<const SettingOf<CompareOptions>> compare_settings();

}  // namespace qjulia
