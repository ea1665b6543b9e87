#pragma once
/// The unit ball, which q² has for its filled Julia set, and where rays meet it: a closed form for
/// surfaces and pictures.

#include <Eigen/Core>

#include "picture/view.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia::check {

/// q², with the ball's box.
Map unit_ball();

/// The direction of a pixel's ray, of length 1.
Eigen::Vector3d ray_direction(const picture::View& view, int column, int row);

/// Where a pixel's ray begins; parallel rays begin apart.
Eigen::Vector3d ray_start(const picture::View& view, int column, int row);

/// Depth at which a pixel's ray meets the unit sphere; negative where it passes by.
double sphere_depth(const picture::View& view, int column, int row);

}  // namespace qjulia::check
