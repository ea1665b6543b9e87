#pragma once
#include <cstddef>
#include <vector>

#include "qjulia/quaternion.hpp"

namespace qjulia::map {

/// `count` unit quaternions spread evenly over the 4-D unit sphere; always the same ones.
std::vector<Quaternion> sphere_directions(std::size_t count);

}  // namespace qjulia::map
