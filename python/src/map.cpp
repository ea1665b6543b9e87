#include "map.hpp"

#include <filesystem>
#include <nlohmann/json.hpp>

#include "arrays.hpp"
#include "keywords.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/detail.hpp"
#include "qjulia/map/map_file.hpp"
#include "unlocked.hpp"
#include "watched.hpp"

namespace py = pybind11;

namespace qjulia::python {
namespace {

static_assert(sizeof(Factor) == 5 * sizeof(double));

std::string text_of(const nlohmann::json& json) {
  return json.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
}

MapPointer load(const py::object& file) {
  std::filesystem::path path;
  read(file, "path", path);
  const Unlocked unlocked;
  return kept(read_map(path));
}

void save(const KeptMap& self, const py::object& file) {
  std::filesystem::path path;
  read(file, "path", path);
  const Unlocked unlocked;
  write_map(self.map, path);
}

MapPointer from_text(const std::string& text) {
  const Unlocked unlocked;
  nlohmann::json json;
  try {
    json = nlohmann::json::parse(text);
  } catch (const nlohmann::json::exception& error) {
    throw InputError(std::string("text: it is no JSON: ") + error.what());
  }
  return kept(map_from_json(json, "text"));
}

/// All that decides about the map's set and where it lies, as text.
std::string content_of(const KeptMap& self) {
  const Unlocked unlocked;
  Map map = self.map;
  map.provenance = {};
  return text_of(to_json(map));
}

/// (N, 5): centre and exponent.
py::array factors_of(const KeptMap& self) {
  const auto rows = static_cast<py::ssize_t>(self.map.dynamics.factors.size());
  return array_of<double>(self.map.dynamics.factors, {rows, 5});
}

/// @param log_scale, surface_level None: the map's own.
MapPointer with_factors(const KeptMap& self, const py::object& given, const py::object& log_scale,
                        const py::object& surface_level) {
  const DoubleArray rows = rows_of_numbers(given, "factors", {5});
  Map map = self.map;
  map.dynamics.factors.clear();
  for (py::ssize_t i = 0; i < rows.shape(0); ++i) {
    map.dynamics.factors.push_back(
        {{rows.at(i, 0), rows.at(i, 1), rows.at(i, 2), rows.at(i, 3)}, rows.at(i, 4)});
  }
  if (!log_scale.is_none()) read(log_scale, "log_scale", map.dynamics.log_scale);
  if (!surface_level.is_none()) read(surface_level, "surface_level", map.dynamics.surface_level);
  map.validate();
  return kept(std::move(map));
}

MapPointer with_provenance(const KeptMap& self, const std::string& text) {
  Map map = self.map;
  map.provenance = nlohmann::json::parse(text);  // the caller has checked it
  return kept(std::move(map));
}

MapPointer calibrated_map(const KeptMap& self, const OpenDevice& device) {
  return kept(
      watched(device, [&](const std::stop_token&) { return calibrated(device.device, self.map); }));
}

MapPointer quadratic(const py::object& c) {
  Quaternion value;
  read(c, "c", value);
  Map map = quadratic_map(value);
  map.validate();
  return kept(std::move(map));
}

/// What the library says of a map in numbers, by name.
py::dict numbers_of(const KeptMap& self) {
  const auto& [dynamics, layers, frame, provenance] = self.map;
  py::dict all;
  all["kind"] = dynamics.kind();
  all["degree"] = dynamics.degree();
  all["log_scale"] = dynamics.log_scale;
  all["surface_level"] = dynamics.surface_level;
  all["slice"] = dynamics.slice;
  const auto phase = coordinates(dynamics.phase);
  all["phase"] = py::make_tuple(phase[0], phase[1], phase[2], phase[3]);
  all["steepness"] = layers.steepness;
  all["is_painted"] = layers.paint.has_value();
  all["portal_count"] = layers.portals.size();
  const auto number = [](const std::optional<double>& value) -> py::object {
    if (!value) return py::none();
    return py::float_(*value);
  };
  all["detail"] = number(frame.detail);
  all["diagonal"] = number(frame.own_diagonal());
  all["inradius"] = number(frame.inradius);
  all["up"] = py::none();
  if (frame.up) all["up"] = to_string(*frame.up);
  all["scale"] = frame.shape_to_map.scale;
  const Eigen::Vector3d& shift = frame.shape_to_map.translation;
  all["translation"] = py::make_tuple(shift.x(), shift.y(), shift.z());
  all["box"] = py::none();
  if (frame.box) {
    const auto& [low, high] = *frame.box;
    all["box"] = py::make_tuple(py::make_tuple(low.x(), low.y(), low.z()),
                                py::make_tuple(high.x(), high.y(), high.z()));
  }
  return all;
}

}  // namespace

void add_map(py::module_& module) {
  py::class_<KeptMap, MapPointer>(module, "Map")
      .def("save", &save)
      .def("json", [](const KeptMap& self) { return text_of(to_json(self.map)); })
      .def("content", &content_of)
      .def("provenance", [](const KeptMap& self) { return text_of(self.map.provenance.json()); })
      .def("with_provenance", &with_provenance)
      .def("numbers", &numbers_of)
      .def("factors", &factors_of)
      .def("with_factors", &with_factors)
      .def("calibrated", &calibrated_map)
      .def("without_portals", [](const KeptMap& self) { return kept(without_portals(self.map)); })
      .def("without_paint", [](const KeptMap& self) { return kept(without_paint(self.map)); });
  module.def("load_map", &load);
  module.def("map_from_json", &from_text);
  module.def("quadratic_map", &quadratic);
}

}  // namespace qjulia::python
