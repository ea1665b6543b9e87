/// Meshes of sets, and how well sets fit a mesh.

#include "qjulia/surface.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "arrays.hpp"
#include "keywords.hpp"
#include "map.hpp"
#include "mesh.hpp"
#include "parts.hpp"
#include "picture.hpp"
#include "qjulia/compare.hpp"
#include "qjulia/compare_settings.hpp"
#include "qjulia/error.hpp"
#include "qjulia/figures.hpp"
#include "qjulia/picture_settings.hpp"
#include "qjulia/print.hpp"
#include "qjulia/print_settings.hpp"
#include "qjulia/surface_colors.hpp"
#include "qjulia/surface_settings.hpp"
#include "watched.hpp"

namespace py = pybind11;

namespace qjulia::python {
namespace {

/// What of the mesh is wanted.
struct Selection {
  bool keep_loose = false;
  double min_component = 0;  ///< least area kept, over the largest part's
  PrintOptions print;
};

Selection selection(Keywords& keywords) {
  Selection wanted;
  PrintOptions& print = wanted.print;
  bool largest = false;
  std::optional<double> min_component;
  keywords.take("keep_loose", wanted.keep_loose);
  keywords.take("largest_component", largest);
  keywords.take("min_component", min_component);
  keywords.take_all(print_settings(), print);
  if (min_component && !(*min_component >= 0 && *min_component <= 1)) {
    throw OptionError("min_component", "it must be 0 to 1");
  }
  if (wanted.keep_loose + largest + min_component.has_value() > 1) {
    throw InputError(
        "keep_loose, largest_component and min_component exclude each other; give one of them");
  }
  print.keep_loose = wanted.keep_loose || min_component.has_value();
  // Who chooses among components has no loose pieces dropped before.
  wanted.keep_loose = wanted.keep_loose || largest || min_component.has_value();
  wanted.min_component = largest ? 1 : min_component.value_or(0);
  print.validate();
  return wanted;
}

TriangleMesh selected(TriangleMesh mesh, Selection wanted, std::optional<UpAxis> up,
                      const ProgressMonitor& monitor) {
  if (mesh.triangles.empty()) return mesh;
  if (!wanted.keep_loose) drop_loose_pieces(mesh);
  if (wanted.min_component > 0) mesh = large_components(mesh, wanted.min_component);
  if (!wanted.print.is_any()) return mesh;
  wanted.print.up = up.value_or(kDefaultUp);
  return made_printable(std::move(mesh), wanted.print, monitor).mesh;
}

py::tuple surface_of(const KeptMap& self, const OpenDevice& device, const py::object& on_progress,
                     const py::dict& given) {
  SurfaceOptions options;
  Keywords keywords("surface", given);
  keywords.take_all(surface_settings(), options);
  const Selection wanted = selection(keywords);
  keywords.expect_no_more();
  options.validate();
  TriangleMesh mesh;
  Watcher watcher;
  const ProgressMonitor monitor = watcher.monitor(on_progress);
  watcher.run(device, [&] {
    mesh = selected(extract_surface(device.device, self.map, options, monitor), wanted,
                    self.map.frame.up, monitor);
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
  module.def("compare_settings", [] { return described(compare_settings(), CompareOptions{}); });
}

}  // namespace qjulia::python
