#pragma once
/// The settings of a profile, described. The map, the mesh and the choice of kernels are none.

#include <span>

#include "qjulia/base/setting.hpp"
#include "qjulia/profile/profile.hpp"

namespace qjulia {

std::span<const SettingOf<ProfileOptions>> profile_settings();

/// Those of them that `tune` and `measure_grid` use.
std::span<const SettingOf<ProfileOptions>> tune_settings();

}  // namespace qjulia
