#pragma once
/// The settings of portals that the program plants, described.

#include <span>

#include "qjulia/portal_choice.hpp"
#include "qjulia/setting.hpp"

namespace qjulia {

std::span<const SettingOf<PortalOptions>> portal_settings();

}  // namespace qjulia
