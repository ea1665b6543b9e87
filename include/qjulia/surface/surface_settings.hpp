#pragma once
/// The settings of a surface, described.

#include <span>

#include "qjulia/base/setting.hpp"
#include "qjulia/surface/surface.hpp"

namespace qjulia {

std::span<const SettingOf<SurfaceOptions>> surface_settings();

}  // namespace qjulia
