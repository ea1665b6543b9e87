#pragma once
/// The unit ball, which q² has for its filled Julia set, as rays must meet it.

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "picture/depth_source.hpp"
#include "picture/view.hpp"
#include "qjulia/picture.hpp"
#include "test_device.hpp"

namespace qjulia::test {

inline RationalMap square() {
  RationalMap map;
  map.factors = {Factor{{0, 0, 0, 0}, 2}};
  map.box = Box{Eigen::Vector3d::Constant(-1), Eigen::Vector3d::Constant(1)};
  return map;
}

inline Device with_width(int width) { return shared_device().with_lane_width(width); }

inline picture::View ball_view(int width, int height, int samples) {
  return picture::camera_view({}, *square().box, width, height, samples);
}

inline Eigen::Vector3d direction(const picture::View& view, int column, int row) {
  return (view.dir + (column + 0.5) * view.dir_dx + (row + 0.5) * view.dir_dy).normalized();
}

/// Where a pixel's ray begins; parallel rays begin apart.
inline Eigen::Vector3d eye(const picture::View& view, int column, int row) {
  return view.eye + (column + 0.5) * view.eye_dx + (row + 0.5) * view.eye_dy;
}

/// Depth at which a pixel's ray meets the unit sphere; negative where it passes by.
inline double sphere_depth(const picture::View& view, int column, int row) {
  const Eigen::Vector3d d = direction(view, column, row);
  const double middle = -view.eye.dot(d);
  const double half2 = middle * middle - view.eye.squaredNorm() + 1;
  return half2 < 0 ? -1 : middle - std::sqrt(half2);
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
