#pragma once
/// The settings of a surface, described.

#include <span>

#include "qjulia/setting.hpp"
#include "qjulia/surface.hpp"

namespace qjulia {

std::span<const SettingOf<SurfaceOptions>> surface_settings();

}  // namespace qjulia
