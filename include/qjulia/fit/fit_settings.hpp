#pragma once
/// The settings of a fit that are numbers, words or flags, described.

#include <span>
#include <string_view>

#include "qjulia/base/setting.hpp"
#include "qjulia/fit/fit.hpp"

namespace qjulia {

struct FitSetting : SettingOf<FitOptions> {
  /// Whether a resumed fit may have another value: the factors do not depend on it.
  bool may_differ_on_resume = false;
};

std::span<const FitSetting> fit_settings();

/// The setting whose member of the struct has this name. @throws InputError where there is none.
const FitSetting& fit_setting_named(std::string_view name);

}  // namespace qjulia
