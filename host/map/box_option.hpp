#pragma once

#include <cmath>
#include <optional>

#include "qjulia/box.hpp"
#include "qjulia/error.hpp"

namespace qjulia::map {

/// @param field the option's name. @throws OptionError unless it is left out, or finite with a
/// volume.
inline void expect_box(const std::optional<Box>& box, const char* field = "box") {
  if (!box || (box->low.allFinite() && box->high.allFinite() && (box->size().array() > 0).all() &&
               std::isfinite(box->diagonal()))) {
    return;
  }
  throw OptionError(field, "give x0 y0 z0 x1 y1 z1 with x0 < x1, y0 < y1, z0 < z1");
}

}  // namespace qjulia::map
