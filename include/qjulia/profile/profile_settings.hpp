#pragma once
/// The settings of a profile, described. The map, the mesh and the choice of kernels are none.

#include <span>

#include "qjulia/base/setting.hpp"
#include "qjulia/profile/profile.hpp"

namespace qjulia {

std::span<const SettingOf<ProfileOptions>> profile_settings();

}  // namespace qjulia
