#pragma once
/// The settings of a print, described. Lengths are in the units of the result.

#include <span>

#include "qjulia/base/setting.hpp"
#include "qjulia/surface/print.hpp"

namespace qjulia {

/// All but the mesh's up axis and loose pieces, which surfaces have settings for.
std::span<const SettingOf<PrintOptions>> print_settings();

}  // namespace qjulia
