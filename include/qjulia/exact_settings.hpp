#pragma once
/// The settings of an exact map that are numbers or words, described.

#include <span>

#include "qjulia/exact_map.hpp"
#include "qjulia/setting.hpp"

namespace qjulia {

/// All but the versor, and the phase in front of it.
std::span<const SettingOf<ExactMapOptions>> exact_settings();

}  // namespace qjulia
