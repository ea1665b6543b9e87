#pragma once
/// The settings of portals that the program plants, described.

#include <span>

#include "qjulia/base/setting.hpp"
#include "qjulia/edit/portal_choice.hpp"

namespace qjulia {

std::span<const SettingOf<PortalOptions>> portal_settings();

}  // namespace qjulia
