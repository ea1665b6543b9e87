/// qjulia._core: what the package's Python files are written on. It is not for users.

#include "errors.hpp"
#include "map.hpp"
#include "mesh.hpp"
#include "parts.hpp"
#include "qjulia/base/version.hpp"
#include "unlocked.hpp"

PYBIND11_MODULE(_core, module) {
  using namespace qjulia::python;
  module.attr("__version__") = qjulia::version();
  add_errors(module);
  add_end_of_work(module);
  add_device(module);
  add_mesh(module);
  add_map(module);
  add_distances(module);
  add_edits(module);
  add_energy(module);
  add_evaluation(module);
  add_fitting(module);
  add_jobs(module);
  add_morph(module);
  add_surfaces(module);
  add_opencl(module);
  add_pictures(module);
  add_profiles(module);
}
