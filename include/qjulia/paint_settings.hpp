#pragma once
/// The settings of paints that are numbers, described.

#include <span>

#include "qjulia/painting.hpp"
#include "qjulia/setting.hpp"

namespace qjulia {

std::span<const SettingOf<PaintOptions>> paint_settings();

}  // namespace qjulia
