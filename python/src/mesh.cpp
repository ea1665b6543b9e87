#include "mesh.hpp"

#include <filesystem>
#include <limits>
#include <utility>

#include "arrays.hpp"
#include "keywords.hpp"
#include "map.hpp"
#include "qjulia/map/map_file.hpp"
#include "unlocked.hpp"

namespace py = pybind11;

namespace qjulia::python {
namespace {

TriangleMesh mesh_of(const py::object& vertices, const py::object& faces) {
  const DoubleArray points = rows_of_numbers(vertices, "vertices", {3});
  const IndexArray corners = rows_of_indices(faces, "faces", 3);
  TriangleMesh mesh;
  mesh.vertices.reserve(static_cast<std::size_t>(points.shape(0)));
  for (py::ssize_t i = 0; i < points.shape(0); ++i) {
    mesh.vertices.emplace_back(points.at(i, 0), points.at(i, 1), points.at(i, 2));
  }
  mesh.triangles.reserve(static_cast<std::size_t>(corners.shape(0)));
  for (py::ssize_t i = 0; i < corners.shape(0); ++i) {
    Triangle& triangle = mesh.triangles.emplace_back();
    for (py::ssize_t j = 0; j < 3; ++j) {
      const std::int64_t index = corners.at(i, j);
      if (index < 0 || index >= points.shape(0) ||
          index > std::numeric_limits<std::uint32_t>::max()) {
        throw py::value_error("faces[" + std::to_string(i) + "] has the index " +
                              std::to_string(index) + ", and there are " +
                              std::to_string(points.shape(0)) + " vertices");
      }
      triangle[static_cast<std::size_t>(j)] = static_cast<std::uint32_t>(index);
    }
  }
  return mesh;
}

/// The mesh, the warnings for its user, and the index that each vertex of the file has in the mesh:
/// -1 where it was left out.
py::tuple tuple_of(InspectedMesh found) {
  py::list warnings;
  for (const std::string& warning : found.report.warnings()) warnings.append(warning);
  std::vector<std::int64_t> places;
  places.reserve(found.report.vertex_of_file.size());
  for (const std::uint32_t vertex : found.report.vertex_of_file) {
    places.push_back(vertex == MeshReport::kNoVertex ? -1 : std::int64_t{vertex});
  }
  const auto count = static_cast<py::ssize_t>(places.size());
  return py::make_tuple(std::move(found.mesh), warnings,
                        array_of<std::int64_t>(std::move(places), {count}));
}

py::tuple read_file(const py::object& file) {
  std::filesystem::path path;
  read(file, "path", path);
  InspectedMesh found = [&] {
    const Unlocked unlocked;
    return read_and_inspect_mesh(path);
  }();
  return tuple_of(std::move(found));
}

py::tuple as_of_a_file(const TriangleMesh& mesh) {
  InspectedMesh found = [&] {
    const Unlocked unlocked;
    return as_if_read(mesh);
  }();
  return tuple_of(std::move(found));
}

void write_file(const TriangleMesh& mesh, const py::object& file, const py::object& up,
                const KeptMap* map) {
  std::filesystem::path path;
  read(file, "path", path);
  std::optional<UpAxis> axis;
  if (!up.is_none()) read(up, "up", axis);
  const Unlocked unlocked;
  mesh.validate();
  MeshFileOptions options;
  options.up = axis;
  if (map != nullptr) options.map = packed_map(map->map);
  write_mesh(mesh, path, options);
}

void set_normals(TriangleMesh& mesh, const py::object& given) {
  const DoubleArray normals = rows_of_numbers(given, "normals", {3});
  for (py::ssize_t i = 0; i < normals.shape(0); ++i) {
    mesh.normals.push_back(
        Eigen::Vector3d(normals.at(i, 0), normals.at(i, 1), normals.at(i, 2)).cast<float>());
  }
}

void set_colors(TriangleMesh& mesh, const py::object& given) {
  constexpr std::int64_t kMost = 255;
  const IndexArray colors = rows_of_indices(given, "colors", 3);
  for (py::ssize_t i = 0; i < colors.shape(0); ++i) {
    VertexColor& color = mesh.colors.emplace_back();
    for (py::ssize_t c = 0; c < 3; ++c) {
      const std::int64_t value = colors.at(i, c);
      if (value < 0 || value > kMost) {
        throw py::value_error("colors[" + std::to_string(i) + "] has " + std::to_string(value) +
                              "; colours are 0 to 255");
      }
      color[static_cast<std::size_t>(c)] = static_cast<std::uint8_t>(value);
    }
  }
}

}  // namespace

py::tuple arrays_of(TriangleMesh mesh) {
  const auto rows = [](const auto& items) { return static_cast<py::ssize_t>(items.size()); };
  const std::vector<py::ssize_t> vertex_shape{rows(mesh.vertices), 3};
  const std::vector<py::ssize_t> face_shape{rows(mesh.triangles), 3};
  const std::vector<py::ssize_t> normal_shape{rows(mesh.normals), 3};
  return py::make_tuple(array_of<double>(std::move(mesh.vertices), vertex_shape),
                        array_of<std::uint32_t>(std::move(mesh.triangles), face_shape),
                        array_of<float>(std::move(mesh.normals), normal_shape));
}

void add_mesh(py::module_& module) {
  py::class_<TriangleMesh>(module, "Mesh")
      .def(py::init(&mesh_of))
      .def("set_normals", &set_normals)
      .def("set_colors", &set_colors)
      .def("arrays", [](const TriangleMesh& self) { return arrays_of(self); });
  module.def("read_mesh", &read_file);
  module.def("as_if_read", &as_of_a_file);
  module.def("write_mesh", &write_file);
}

}  // namespace qjulia::python
