#pragma once
/// The settings of a sampled field, described.

#include <span>

#include "qjulia/sample.hpp"
#include "qjulia/setting.hpp"

namespace qjulia {

std::span<const SettingOf<SampleOptions>> sample_settings();

}  // namespace qjulia
