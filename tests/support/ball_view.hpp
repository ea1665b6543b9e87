#pragma once
/// The unit ball, which q² has for its filled Julia set, as rays must meet it.

#include <vector>

#include "check/unit_ball.hpp"
#include "picture/depth_source.hpp"
#include "picture/view.hpp"
#include "qjulia/picture/picture.hpp"
#include "test_device.hpp"

namespace qjulia::test {

inline Device with_width(int width) { return shared_device().with_lane_width(width); }

inline picture::View ball_view(int width, int height, int samples) {
  return picture::camera_view({}, *check::unit_ball().frame.box, width, height, samples);
}

/// Calls `visit(column, row, depth)` for each pixel of the view.
template <class Visit>
void for_pixels(const picture::View& view, const std::vector<float>& depths, const Visit& visit) {
  std::size_t pixel = 0;
  for (int row = 0; row < view.rows; ++row) {
    for (int column = 0; column < view.columns; ++column, ++pixel) {
      visit(column, row, static_cast<double>(depths.at(pixel)));
    }
  }
}

inline PictureOptions picture_of(int width, int height) {
  PictureOptions options;
  options.width = width;
  options.height = height;
  return options;
}

}  // namespace qjulia::test
