#pragma once
/// Settings of views that can go from one value to another: in sweeps and in films.

#include <functional>
#include <map>
#include <span>
#include <string>

#include "describe/view_options.hpp"
#include "qjulia/base/setting.hpp"

namespace qjulia::tools {

/// A setting, or a part of one, whose value is some numbers.
struct MovingSetting {
  std::string of;  ///< the option that it belongs to: "phase" of "phase-i"
  std::size_t numbers = 1;
  Interpolation interpolation = Interpolation::linear;
  bool is_of_map = false;  ///< a mesh has no such setting
  /// Gives the setting a value. @throws InputError for one that it cannot have
  std::function<void(std::span<const double>, View&)> set;
};

/// By the names that users call them: options without dashes, and parts such as "phase-i" and
/// "cut-z".
const std::map<std::string, MovingSetting, std::less<>>& moving_settings();

}  // namespace qjulia::tools
