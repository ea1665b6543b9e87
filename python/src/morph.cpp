/// Maps between two maps.

#include <utility>
#include <vector>

#include "keywords.hpp"
#include "map.hpp"
#include "parts.hpp"
#include "qjulia/morph/morph_steps.hpp"
#include "qjulia/morph/versor_transfer.hpp"
#include "watched.hpp"

namespace py = pybind11;

namespace qjulia::python {
namespace {

py::dict dict_of(const MorphPairs& pairs) {
  py::dict all;
  all["matched"] = pairs.matched;
  all["appearing"] = pairs.appearing;
  all["vanishing"] = pairs.vanishing;
  return all;
}

/// None where there were too few steps to tell, or none was asked for.
py::object dict_of(const Flicker& flicker) {
  if (flicker.steps == 0) return py::none();
  py::dict all;
  all["mean"] = flicker.mean;
  all["worst"] = flicker.worst;
  all["changed"] = flicker.changed;
  return all;
}

/// @return its maps, factors and flicker
py::tuple morphed(const OpenDevice& device, const KeptMap& from, const KeptMap& to,
                  const py::object& on_progress, const py::dict& given) {
  MorphOptions options;
  Keywords keywords("morph", given);
  keywords.take_all(morph_settings(), options);
  keywords.expect_no_more();
  options.validate();
  std::vector<MapPointer> maps;
  MorphPairs pairs;
  Flicker flicker;
  Watcher watcher;
  const ProgressMonitor monitor = watcher.monitor(on_progress);
  watcher.run(device, [&] {
    const Morph morph(device.device, from.map, to.map, monitor);
    pairs = morph.pairs();
    const auto keep = [&](Map map, int /*step*/) { maps.push_back(kept(std::move(map))); };
    flicker = make_steps(device.device, morph, options, keep, monitor);
  });
  py::list all;
  for (MapPointer& map : maps) all.append(std::move(map));
  return py::make_tuple(all, dict_of(pairs), dict_of(flicker));
}

MapPointer with_versor(const OpenDevice& device, const KeptMap& map, const KeptMap& grooves) {
  return kept(watched(device, [&](const std::stop_token& stop) {
    ProgressMonitor monitor;
    monitor.stop = stop;
    return with_versor_of(device.device, map.map, grooves.map, kTransferCells, monitor);
  }));
}

}  // namespace

void add_morph(py::module_& module) {
  module.def("morph", &morphed);
  module.def("morph_settings", [] { return described(morph_settings(), MorphOptions{}); });
  module.def("with_versor_of", &with_versor);
}

}  // namespace qjulia::python
