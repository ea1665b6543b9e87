#pragma once
/// The settings of an exact map that are numbers or words, described.

#include <span>

#include "qjulia/base/setting.hpp"
#include "qjulia/exact/exact_map.hpp"

namespace qjulia {

/// All but the versor, and the phase in front of it.
std::span<const SettingOf<ExactMapOptions>> exact_settings();

}  // namespace qjulia
