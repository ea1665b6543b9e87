#pragma once

#include <optional>

#include "qjulia/rational_map.hpp"

namespace qjulia::map {

/// @param field the option's name. @throws OptionError unless it is left out, or finite with a
/// volume.
void expect_box(const std::optional<Box>& box, const char* field = "box");

}  // namespace qjulia::map
