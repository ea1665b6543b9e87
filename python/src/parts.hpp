#pragma once
/// The parts that the module is made of.

#include <pybind11/pybind11.h>

namespace qjulia::python {

void add_edits(pybind11::module_& module);      ///< knobs, paint, portals and roughness
void add_distances(pybind11::module_& module);  ///< distances from meshes
void add_energy(pybind11::module_& module);
void add_evaluation(pybind11::module_& module);  ///< fields at points and on grids
void add_fitting(pybind11::module_& module);     ///< maps from meshes
void add_jobs(pybind11::module_& module);        ///< commands as data
void add_morph(pybind11::module_& module);       ///< maps between two maps
void add_opencl(pybind11::module_& module);      ///< queues and buffers of pyopencl
void add_pictures(pybind11::module_& module);
void add_profiles(pybind11::module_& module);  ///< profiles, tuning, checks of a device
void add_surfaces(pybind11::module_& module);  ///< meshes of sets, and how well they fit

}  // namespace qjulia::python
