#pragma once
/// A lens in place of the pin-hole: many views through it, whose mean is sharp at its focus alone.

#include <vector>

#include "picture/view.hpp"

namespace qjulia::picture {

/// Views of the same pixels from points of a lens, the first from its middle. All show the plane at
/// `focus` along the view's axis in the same place. Points lie along a golden spiral, and rays of
/// the views go through different points of the pixels.
/// @param view a perspective one, of one sample a pixel. @param width of the lens, a share of
/// `focus`.
std::vector<View> lens_views(const View& view, double width, double focus, int count);

/// How far a point lies before the eye, along the axis of a perspective view.
double distance_along_axis(const View& view, const Eigen::Vector3d& point);

}  // namespace qjulia::picture
