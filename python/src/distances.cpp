/// Distances from meshes, and points on them: what samples of your own are made of.

#include <utility>

#include "arrays.hpp"
#include "keywords.hpp"
#include "parts.hpp"
#include "qjulia/mesh/shape.hpp"
#include "unlocked.hpp"
#include "watched.hpp"

namespace py = pybind11;

namespace qjulia::python {
namespace {

py::array signed_distance(const OpenDevice& device, const TriangleMesh& mesh,
                          const py::object& points, const py::dict& given) {
  Precision precision = Precision::single;
  Keywords keywords("signed_distance", given);
  keywords.take("precision", precision);
  keywords.expect_no_more();
  const DoubleArray rows = rows_of_numbers(points, "points", {3});
  std::vector<Eigen::Vector3d> at;
  at.reserve(static_cast<std::size_t>(rows.shape(0)));
  for (py::ssize_t i = 0; i < rows.shape(0); ++i) {
    at.emplace_back(rows.at(i, 0), rows.at(i, 1), rows.at(i, 2));
  }
  auto distances = watched(device, [&](const std::stop_token& stop) {
    return SignedDistance(device.device, mesh, precision, stop).at(at, stop);
  });
  const auto count = static_cast<py::ssize_t>(distances.size());
  return array_of<double>(std::move(distances), {count});
}

py::tuple points_on(const TriangleMesh& mesh, const py::object& count, const py::object& seed) {
  constexpr int kMost = 100'000'000;
  int wanted = 0;
  read(count, "count", wanted);
  if (wanted < 0 || wanted > kMost) {
    throw py::value_error("count must be 0 to " + std::to_string(kMost) + ", not " + shown(count));
  }
  std::uint64_t drawn_with = 1;
  read(seed, "seed", drawn_with);
  const std::vector<SurfacePoint> found = [&] {
    const Unlocked unlocked;
    return sample_surface(mesh, static_cast<std::size_t>(wanted), drawn_with);
  }();
  std::vector<Eigen::Vector3d> positions, normals;
  for (const auto& [position, normal] : found) {
    positions.push_back(position);
    normals.push_back(normal);
  }
  const std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(found.size()), 3};
  return py::make_tuple(array_of<double>(std::move(positions), shape),
                        array_of<double>(std::move(normals), shape));
}

}  // namespace

void add_distances(py::module_& module) {
  module.def("signed_distance", &signed_distance);
  module.def("sample_surface", &points_on);
}

}  // namespace qjulia::python
