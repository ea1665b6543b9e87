#include "points.hpp"

#include "arrays.hpp"

namespace py = pybind11;

namespace qjulia::python {

GivenPoints given_points(const Map& map, const py::object& points, bool in_shape) {
  const DoubleArray rows = rows_of_numbers(points, "points", {3, 4});
  GivenPoints given;
  given.length = static_cast<int>(rows.shape(1));
  if (given.length == 4 && in_shape) {
    throw py::value_error(
        "points of shape (N, 4) are in map coordinates; give space=\"map\" with them");
  }
  const ShapeToMap& to_map = map.frame.shape_to_map;
  if (in_shape) given.slope = to_map.scale;
  given.at.reserve(static_cast<std::size_t>(rows.shape(0)));
  const double* row = rows.data();
  for (py::ssize_t i = 0; i < rows.shape(0); ++i, row += given.length) {
    Eigen::Vector3d x(row[0], row[1], row[2]);
    if (in_shape) x = to_map.to_map(x);
    given.at.push_back({x.x(), x.y(), x.z(), given.length == 4 ? row[3] : map.dynamics.slice});
  }
  return given;
}

}  // namespace qjulia::python
