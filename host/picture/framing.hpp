#pragma once
/// Where cameras stand so that what they frame fills their pictures.

#include <Eigen/Core>
#include <span>
#include <stop_token>
#include <vector>

#include "qjulia/picture/picture.hpp"

namespace qjulia::picture {

/// A few of the points, which reach as far in every direction as all of them, to 1 % of their
/// extent.
std::vector<Eigen::Vector3d> extremes(const std::vector<Eigen::Vector3d>& points,
                                      const std::stop_token& stop = {});

/// `Studio::aimed`, for cameras that say what is up.
/// @param outline of what is framed, not empty, in the cameras' units. @param aspect of the
/// pictures: width over height.
std::vector<Camera> aimed(std::span<const Camera> cameras, std::span<const Eigen::Vector3d> outline,
                          double aspect);

}  // namespace qjulia::picture
