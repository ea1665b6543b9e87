#pragma once
/// The settings of paints that are numbers, described.

#include <span>

#include "qjulia/base/setting.hpp"
#include "qjulia/edit/painting.hpp"

namespace qjulia {

std::span<const SettingOf<PaintOptions>> paint_settings();

}  // namespace qjulia
