/// Maps from maps: knobs, paint, portals and roughness.

#include <optional>
#include <string>
#include <utility>

#include "arrays.hpp"
#include "keywords.hpp"
#include "map.hpp"
#include "parts.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/edit/map_detail.hpp"
#include "qjulia/edit/paint_settings.hpp"
#include "qjulia/edit/painting.hpp"
#include "qjulia/edit/portal_choice.hpp"
#include "qjulia/edit/portal_settings.hpp"
#include "qjulia/map/knob_table.hpp"
#include "qjulia/surface/roughness_target.hpp"
#include "watched.hpp"

namespace py = pybind11;

namespace qjulia::python {
namespace {

MapPointer turned(const KeptMap& self, const OpenDevice& device, const py::dict& given) {
  MapKnobs knobs;
  Keywords keywords("with_knobs", given);
  std::optional<DetailWord> word;
  if (const auto detail = keywords.argument("detail"); detail && py::isinstance<py::str>(detail)) {
    DetailChoice choice;
    read(detail, "detail", choice);
    word = std::get<DetailWord>(choice);
  }
  for (const Knob& knob : knob_table()) {
    if (word && knob.name == "detail") continue;
    const ValuePlace place = knob.place(knobs);
    keywords.take(knob, place);
    expect_in_range(knob, place);
  }
  keywords.expect_no_more();
  knobs.validate();
  return kept(watched(device, [&](const std::stop_token& stop) {
    if (word) knobs.detail = detail_for(device.device, self.map, *word, stop);
    return with_knobs(device.device, self.map, knobs);
  }));
}

PaintRamp ramp_of(const py::handle& given) {
  const auto sequence = py::reinterpret_borrow<py::object>(given);
  if (!py::isinstance<py::sequence>(sequence) || py::len(sequence) != 3) {
    throw py::value_error("ramp must be an axis and two shares, such as (\"y\", 1, 0.1), not " +
                          shown(given));
  }
  PaintRamp ramp;
  read_word(sequence[py::int_(0)], "ramp", ramp.axis, {{"x", 0}, {"y", 1}, {"z", 2}});
  read(sequence[py::int_(1)], "ramp", ramp.low);
  read(sequence[py::int_(2)], "ramp", ramp.high);
  return ramp;
}

/// @param mesh None, or a Mesh whose vertices have `shares`.
PaintOptions paint_options(const py::object& mesh, const py::object& shares,
                           const py::dict& given) {
  PaintOptions options;
  Keywords keywords("paint", given);
  keywords.take_all(paint_settings(), options);
  if (const auto ramp = keywords.argument("ramp")) options.ramp = ramp_of(ramp);
  if (const auto balls = keywords.argument("balls")) {
    const DoubleArray rows = rows_of_numbers(balls, "balls", {5});
    for (py::ssize_t i = 0; i < rows.shape(0); ++i) {
      options.balls.push_back(
          {{rows.at(i, 0), rows.at(i, 1), rows.at(i, 2)}, rows.at(i, 3), rows.at(i, 4)});
    }
  }
  if (const auto blocks = keywords.argument("blocks")) {
    const DoubleArray rows = rows_of_numbers(blocks, "blocks", {7});
    for (py::ssize_t i = 0; i < rows.shape(0); ++i) {
      options.blocks.push_back({{{rows.at(i, 0), rows.at(i, 1), rows.at(i, 2)},
                                 {rows.at(i, 3), rows.at(i, 4), rows.at(i, 5)}},
                                rows.at(i, 6)});
    }
  }
  if (!mesh.is_none()) {
    const auto& triangles = mesh.cast<const TriangleMesh&>();
    PaintedMesh painted{triangles.vertices, triangles.triangles, {}};
    for (const double share : numbers_for(shares, "shares", painted.vertices.size())) {
      painted.shares.push_back(static_cast<float>(share));
    }
    options.mesh = std::move(painted);
  }
  keywords.expect_no_more();
  options.validate();
  return options;
}

MapPointer with_paint(const KeptMap& self, const OpenDevice& device, const py::object& mesh,
                      const py::object& shares, const py::object& on_progress,
                      const py::dict& given) {
  const PaintOptions options = paint_options(mesh, shares, given);
  Map map = without_paint(self.map);
  Watcher watcher;
  const ProgressMonitor monitor = watcher.monitor(on_progress);
  watcher.run(device, [&] { map.layers.paint = painted(device.device, map, options, monitor); });
  return kept(std::move(map));
}

MapPointer with_portals(const KeptMap& self, const OpenDevice& device,
                        const py::object& on_progress, const py::dict& given) {
  PortalOptions options;
  Keywords keywords("portals", given);
  keywords.take_all(portal_settings(), options);
  keywords.expect_no_more();
  options.validate();
  Map map = self.map;
  Watcher watcher;
  const ProgressMonitor monitor = watcher.monitor(on_progress);
  watcher.run(device,
              [&] { map.layers.portals = proposed_portals(device.device, map, options, monitor); });
  return kept(std::move(map));
}

/// @param mesh what areas and volumes are measured against; null: the map's smooth set.
MapPointer roughened(const KeptMap& self, const OpenDevice& device, const TriangleMesh* mesh,
                     const py::object& on_progress, const py::dict& given) {
  RoughnessTarget target;
  Keywords keywords("with_roughness", given);
  keywords.take_all(target_settings(), target);
  keywords.expect_no_more();
  target.validate();
  Map map;
  Watcher watcher;
  const ProgressMonitor monitor = watcher.monitor(on_progress);
  watcher.run(device, [&] {
    std::optional<RoughnessReference> reference;
    if (mesh != nullptr) reference = reference_of(device.device, *mesh, monitor.stop);
    map = with_roughness(device.device, self.map, target, reference, monitor).map;
  });
  return kept(std::move(map));
}

}  // namespace

void add_edits(py::module_& module) {
  module.def("with_knobs", &turned);
  module.def("knob_table", [] { return described(knob_table(), MapKnobs{}); });
  module.def("paint", &with_paint);
  module.def("paint_settings", [] { return described(paint_settings(), PaintOptions{}); });
  module.def("portals", &with_portals);
  module.def("portal_settings", [] { return described(portal_settings(), PortalOptions{}); });
  module.def("with_roughness", &roughened);
  module.def("target_settings", [] { return described(target_settings(), RoughnessTarget{}); });
}

}  // namespace qjulia::python
