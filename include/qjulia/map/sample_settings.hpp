#pragma once
/// The settings of a sampled field, described.

#include <span>

#include "qjulia/base/setting.hpp"
#include "qjulia/map/sample.hpp"

namespace qjulia {

std::span<const SettingOf<SampleOptions>> sample_settings();

}  // namespace qjulia
