/// Meshes of sets, and how well sets fit a mesh.

#include "qjulia/surface/surface.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "arrays.hpp"
#include "keywords.hpp"
#include "map.hpp"
#include "mesh.hpp"
#include "parts.hpp"
#include "picture.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/picture/picture_settings.hpp"
#include "qjulia/picture/surface_colors.hpp"
#include "qjulia/surface/compare.hpp"
#include "qjulia/surface/compare_settings.hpp"
#include "qjulia/surface/figures.hpp"
#include "qjulia/surface/print.hpp"
#include "qjulia/surface/print_settings.hpp"
#include "qjulia/surface/selection.hpp"
#include "qjulia/surface/surface_settings.hpp"
#include "watched.hpp"

namespace py = pybind11;

namespace qjulia::python {
namespace {

TriangleMesh selected(TriangleMesh mesh, const Selection& selection, PrintOptions print,
                      const Map& map, const ProgressMonitor& monitor) {
  select_parts(mesh, selection);
  if (print.is_any() && !mesh.triangles.empty()) {
    print.up = map.frame.up.value_or(kDefaultUp);
    print.keep_loose = selection.keep_loose || selection.min_component;
    mesh = made_printable(std::move(mesh), print, monitor).mesh;
  }
  return cut_open(std::move(mesh), selection, map.frame.box);
}

py::tuple surface_of(const KeptMap& self, const OpenDevice& device, const py::object& on_progress,
                     const py::dict& given) {
  SurfaceOptions options;
  Selection selection;
  PrintOptions print;
  Keywords keywords("surface", given);
  keywords.take_all(surface_settings(), options);
  keywords.take_all(print_settings(), print);
  keywords.take_all(selection_settings(), selection);
  keywords.expect_no_more();
  options.validate();
  print.validate();
  selection.validate();
  if (print.is_any() && !selection.cuts.empty()) {
    throw OptionError("cut", "it opens the mesh, and prints need a closed one");
  }
  TriangleMesh mesh;
  Watcher watcher;
  const ProgressMonitor monitor = watcher.monitor(on_progress);
  watcher.run(device, [&] {
    mesh = selected(extract_surface(device.device, self.map, options, monitor), selection, print,
                    self.map, monitor);
  });
  return arrays_of(std::move(mesh));
}

py::array colors_of(const KeptMap& self, const OpenDevice& device, const TriangleMesh& mesh,
                    const py::object& on_progress, const py::dict& given) {
  PictureOptions look;
  look.material = Material::iterations;
  Keywords keywords("surface_colors", given);
  const PictureSetting& material = picture_setting_named("material");
  keywords.take(material, material.place(look));
  take_palette(keywords, look);
  SurfaceColorOptions options{.material = look.material, .palette = look.palette};
  keywords.take("range", options.range);
  keywords.take("n", options.iterations);
  keywords.take("precision", options.precision);
  keywords.take("escape", options.escape);
  keywords.expect_no_more();
  options.validate();
  SurfaceColors found;
  Watcher watcher;
  const ProgressMonitor monitor = watcher.monitor(on_progress);
  watcher.run(device,
              [&] { found = surface_colors(device.device, self.map, mesh, options, monitor); });
  const std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(found.colors.size()), 3};
  return array_of<std::uint8_t>(std::move(found.colors), shape);
}

py::dict dict_of(const FitMetrics& metrics) {
  py::dict all;
  all["n"] = metrics.iterations;
  all["iou"] = metrics.iou;
  all["mean_distance"] = metrics.mean_distance;
  all["distance_95"] = metrics.distance_95;
  all["hausdorff_distance"] = metrics.hausdorff_distance;
  all["energy"] = metrics.energy;
  all["roughness"] = metrics.roughness;
  all["slope_variation"] = metrics.slope_variation;
  if (metrics.limbs >= 0) {
    all["limbs"] = metrics.limbs;
    all["limbs_kept"] = metrics.limbs_kept;
  }
  return all;
}

/// Figures at 1 and at `n`, a number.
py::list compared(const KeptMap& self, const OpenDevice& device, const TriangleMesh& mesh,
                  const py::object& on_progress, const py::dict& given) {
  CompareOptions options;
  Keywords keywords("compare", given);
  keywords.take_all(compare_settings(), options);
  keywords.expect_no_more();
  options.validate();
  std::vector<FitMetrics> metrics;
  Watcher watcher;
  const ProgressMonitor monitor = watcher.monitor(on_progress);
  watcher.run(device, [&] { metrics = compare(device.device, self.map, mesh, options, monitor); });
  py::list all;
  for (const FitMetrics& at_n : metrics) all.append(dict_of(at_n));
  return all;
}

}  // namespace

void add_surfaces(py::module_& module) {
  module.def("surface", &surface_of);
  module.def("surface_colors", &colors_of);
  module.def("compare", &compared);
  module.def("surface_settings", [] { return described(surface_settings(), SurfaceOptions{}); });
  module.def("print_settings", [] { return described(print_settings(), PrintOptions{}); });
  module.def("selection_settings", [] { return described(selection_settings(), Selection{}); });
  module.def("compare_settings", [] { return described(compare_settings(), CompareOptions{}); });
}

}  // namespace qjulia::python
