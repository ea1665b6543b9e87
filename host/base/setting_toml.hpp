#pragma once
/// Values of settings from files of TOML.

#include "base/toml.hpp"
#include "qjulia/base/setting.hpp"

namespace qjulia::base {

/// Reads a value as users give it: a number, a word, true or false, and an array of lamps.
/// @throws InputError saying what to give.
void read_value(const toml::node& node, const Setting& setting, const ValuePlace& place);

}  // namespace qjulia::base
