#pragma once
/// Paint that tests lay over maps.

#include <cstdint>

#include "qjulia/map/paint.hpp"

namespace qjulia::test {

/// All over the two balls of `distance_map`, from 1 down to 1/256, in an irregular manner; a third
/// of the cells have the whole detail.
inline Paint patchy_paint() {
  Paint paint;
  paint.cells = {14, 11, 9};
  paint.origin = {-1.9, -1.2, -1.05};
  paint.step = 0.23;
  for (std::size_t i = 0; i < paint.size(); ++i) {
    paint.shares.push_back(
        static_cast<std::uint8_t>(i % 3 == 0 ? 255 : 255 - (i * i * 37 + 11 * i) % 256));
  }
  return paint;
}

}  // namespace qjulia::test
