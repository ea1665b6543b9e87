#pragma once
/// A lens in place of the pin-hole: many views through it, whose mean is sharp at its focus alone.

#include "picture/view.hpp"

namespace qjulia::picture {

/// Number `i` of `count` views of the same pixels from points of a lens, the first from its middle.
/// All show the plane at `focus` along the view's axis in the same place. Points lie along a golden
/// spiral, and rays of the views go through different points of the pixels.
/// @param view a camera's, of one sample a pixel. @param width of the lens, a share of
/// `focus`; 0: a pin-hole.
View lens_view(const View& view, double width, double focus, int i, int count);

/// Which of `count` equal parts of the time, while the shutter is open, view `i` shows: each shows
/// another one, and views that follow each other lie far apart, as their points in a pixel do.
int open_part(int i, int count);

/// How far a point lies before the eye, along the axis of a camera's view.
double distance_along_axis(const View& view, const Eigen::Vector3d& point);

}  // namespace qjulia::picture
