#pragma once
/// Points that users give, in the map's coordinates.

#include <pybind11/pybind11.h>

#include <vector>

#include "qjulia/map/map.hpp"

namespace qjulia::python {

struct GivenPoints {
  std::vector<Quaternion> at;
  int length = 3;    ///< of a row
  double slope = 1;  ///< map units a unit of the points
};

/// @param points (N, 3) on the map's slice, or (N, 4).
/// @param in_shape whether they are in the shape's coordinates, which have three of them.
GivenPoints given_points(const Map& map, const pybind11::object& points, bool in_shape);

}  // namespace qjulia::python
