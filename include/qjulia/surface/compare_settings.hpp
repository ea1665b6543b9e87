#pragma once
/// The settings of a comparison, described.

#include <span>

#include "qjulia/base/setting.hpp"
#include "qjulia/surface/compare.hpp"

namespace qjulia {

std::span<const SettingOf<CompareOptions>> compare_settings();

}  // namespace qjulia
