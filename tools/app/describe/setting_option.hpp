#pragma once
/// Options of commands from tables of settings.

#include "describe/command_line.hpp"
#include "qjulia/base/setting.hpp"

namespace qjulia::tools {

/// The option that gives a setting its value. @param place must stay where it is.
Option add_setting(Command command, const Setting& setting, const ValuePlace& place);

/// Options of all settings of a table, but for palettes: these depend on the material.
template <class Table, class Options>
void add_settings(Command command, const Table& table, Options& options) {
  for (const auto& setting : table) add_setting(command, setting, setting.place(options));
}

/// What the help says of a setting: its sentence and what is used where it is left out, with
/// options in place of the names of other settings.
std::string help_of(const Setting& setting);

/// The setting where another sentence says what it does.
Setting with_help(const Setting& setting, std::string help);

/// A number in the setting's range, or a word. @throws InputError
DetailChoice read_detail(const Setting& setting, const std::string& text);

}  // namespace qjulia::tools
