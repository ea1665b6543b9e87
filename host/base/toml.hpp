#pragma once
/// TOML texts, by toml++.

#include <string>
#include <string_view>

// Without its assertions: some fail on malformed keys that the parser refuses right after.
#define TOML_ASSERT(expression) static_assert(true)
#include <toml++/toml.h>

namespace qjulia::base {

/// Characters that are not ASCII may stand in comments and in double quotes on one line.
/// @param name of the file, for messages. @throws InputError naming it, the line and the cause.
toml::table parse_toml(std::string_view text, const std::string& name);

}  // namespace qjulia::base
