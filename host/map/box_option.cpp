#include "map/box_option.hpp"

#include <cmath>

#include "qjulia/error.hpp"

namespace qjulia::map {

void expect_box(const std::optional<Box>& box, const char* field) {
  if (!box) return;
  const bool is_box = box->low.allFinite() && box->high.allFinite() &&
                      (box->size().array() > 0).all() && std::isfinite(box->diagonal());
  if (!is_box) {
    throw OptionError(field, "give x0 y0 z0 x1 y1 z1 with x0 < x1, y0 < y1, z0 < z1");
  }
}

}  // namespace qjulia::map
